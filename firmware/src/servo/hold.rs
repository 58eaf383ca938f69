//! stub
use hal::wire_enum;
#[derive(Clone,Copy,Debug,PartialEq,Eq,Default)]
#[repr(u8)]
pub enum HoldKind { #[default] Zero, First, Second, Smooth }
wire_enum!(HoldKind{Zero,First,Second,Smooth});
#[derive(Clone,Copy,Debug,Default)]
pub struct Knot { pub station: f32, pub value:[f32;3] }
#[derive(Clone,Debug)]
pub struct Hold{ k:[Knot;64], n:usize }
impl Hold { pub fn new(_:HoldKind)->Self{Hold{k:[Knot::default();64],n:0}} pub fn insert(&mut self,k:Knot){ if self.n<64 {self.k[self.n]=k;self.n+=1;} } pub fn evaluate(&mut self,s:f32)->[f32;3]{
 if self.n==0 {return [0.0;3];}
 if s<=self.k[0].station {return self.k[0].value;}
 let mut i=0; while i+1<self.n && self.k[i+1].station<s {i+=1;}
 if i+1>=self.n {return self.k[self.n-1].value;}
 let (a,b)=(self.k[i],self.k[i+1]); let u=(s-a.station)/(b.station-a.station);
 let m=|j:usize| if j==0||j+1>=self.n {let (p,q)=if j==0{(0,1)}else{(j-1,j)}; core::array::from_fn::<f32,3,_>(|c|(self.k[q].value[c]-self.k[p].value[c])/(self.k[q].station-self.k[p].station))} else {
   let (p,c0,n)=(self.k[j-1],self.k[j],self.k[j+1]); let (h0,h1)=(c0.station-p.station,n.station-c0.station);
   core::array::from_fn(|c|{let d0=(c0.value[c]-p.value[c])/h0; let d1=(n.value[c]-c0.value[c])/h1; (d0*h1+d1*h0)/(h0+h1)})};
 let (ma,mb)=(m(i),m(i+1)); let h=b.station-a.station; let (u2,u3)=(u*u,u*u*u);
 core::array::from_fn(|c| a.value[c]*(2.0*u3-3.0*u2+1.0)+b.value[c]*(3.0*u2-2.0*u3)+h*(ma[c]*(u3-2.0*u2+u)+mb[c]*(u3-u2)))
} }
