//! What the faces of the scene are made of.

/// What a face is made of; the number makes two of a kind differ.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Material {
    Tiles(u32),
    Plaster,
    Bricks,
    WindowWall,
    DoorWall,
    PosterWall(u32),
    Crate(u32),
    Cardboard(u32),
    Cabinet(u32),
}
