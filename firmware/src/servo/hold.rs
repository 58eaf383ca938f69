//! stub
use hal::wire_enum;
#[derive(Clone,Copy,Debug,PartialEq,Eq,Default)]
#[repr(u8)]
pub enum HoldKind { #[default] Zero, First, Second, Smooth }
wire_enum!(HoldKind{Zero,First,Second,Smooth});
#[derive(Clone,Copy,Debug)]
pub struct Knot { pub station: f32, pub value:[f32;3] }
#[derive(Clone,Debug)]
pub struct Hold;
impl Hold { pub fn new(_:HoldKind)->Self{Hold} pub fn insert(&mut self,_:Knot){} pub fn evaluate(&mut self,_:f32)->[f32;3]{[0.0;3]} }
