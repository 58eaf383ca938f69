//! stub
use hal::wire_struct;
#[derive(Clone,Copy,Debug,PartialEq)]
pub struct Limits { pub speed:[f32;6], pub acceleration:[f32;6], pub jerk:[f32;6] }
wire_struct!(Limits{speed:[f32;6],acceleration:[f32;6],jerk:[f32;6]});
#[derive(Clone,Copy,Debug)]
pub struct Profile;
impl Profile { pub fn synchronised(_:&[f32;6],_:&Limits)->Self{Profile} pub fn at(&self,_:f32)->f32{0.0} pub fn duration(&self)->f32{1.0}}
