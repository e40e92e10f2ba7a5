//! Ends of rods that bodies carry or walls hold: data types only.
//!
//! [`Attachment`] lists the nodes of one end that a body carries: one node of a hinged end, two of a clamped one.
//! Each has its number of carried unknowns, its arm on the body and a further arm on a sprung clamp, m, at rest. In
//! space a clamped end carries the edge between both nodes too. [`FixedNode`] is a node at a wall, with its position,
//! m, and its number of fixed unknowns. A place `P` is a vector of two components in a plane and of three in space.

/// A node of a rod that a body carries.
#[derive(Clone, Copy, Debug)]
pub struct CarriedNode<P> {
    /// Index of the node in its rod.
    pub node: usize,
    /// Number of its unknowns that are carried: the coordinates, and in space the angle of the edge after it if that
    /// edge is carried.
    pub width: usize,
    /// Arm on the body, from its center, m, at rest, in the axes of the body.
    pub on_body: P,
    /// Further arm on the sprung clamp, m, at rest, in the axes of the clamp; zero without a spring.
    pub on_clamp: P,
}

/// The edge between both nodes of a clamped end in space.
#[derive(Clone, Copy, Debug)]
pub struct CarriedEdge<P> {
    /// Index of the edge in its rod.
    pub edge: usize,
    /// Its tangent and first material director, in the axes of the clamp or body that carries it.
    pub frame: [P; 2],
}

/// An end of a rod that a body carries, through a spring if there is one.
#[derive(Clone, Debug)]
pub struct Attachment<P> {
    /// Index of the body.
    pub body: usize,
    /// Index of the joint spring between the body and the clamp of the end; none without a spring.
    pub spring: Option<usize>,
    /// One node of a hinged end, two of a clamped one, in ascending order.
    pub nodes: Vec<CarriedNode<P>>,
    /// The edge between the two nodes of a clamped end, in space only.
    pub edge: Option<CarriedEdge<P>>,
}

/// A node at a wall.
#[derive(Clone, Copy, Debug)]
pub struct FixedNode<P> {
    /// Index of the node in its rod.
    pub node: usize,
    /// Number of its unknowns that are fixed; an angle among them is zero.
    pub width: usize,
    /// Position, m.
    pub position: P,
}
