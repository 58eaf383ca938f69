//! stub
use hal::wire_struct;
#[derive(Clone,Copy,Debug,PartialEq)]
pub struct Limits { pub speed:[f32;6], pub acceleration:[f32;6], pub jerk:[f32;6] }
wire_struct!(Limits{speed:[f32;6],acceleration:[f32;6],jerk:[f32;6]});
#[derive(Clone,Copy,Debug)]
pub struct Profile{t:f32}
impl Profile { pub fn synchronised(w:&[f32;6],_:&Limits)->Self{let mut m=0.1f32; for x in w {m=m.max(x.abs());} Profile{t:1.875*m/1.0}} pub fn at(&self,t:f32)->f32{let u=(t/self.t).min(1.0); u*u*u*(10.0-15.0*u+6.0*u*u)} pub fn duration(&self)->f32{self.t}}
