//! Depth from a mesh: a pixel's ray cast against the faces of a PLY file.
//!
//! The ray of a pixel is `(x, y, 1)` in the camera, so that its parameter at the surface is the depth along the
//! optical axis. Faces count from both sides. parry finds the first one through a tree of boxes.

mod polygon;

use std::path::Path;
use std::sync::Arc;

use nalgebra::Point3;
use parry3d::math::Vector;
use parry3d::query::{Ray, RayCast};
use parry3d::shape::TriMesh;
use rayon::prelude::*;
use vice_core::camera::Pixel;
use vice_core::dataset::Floor;
use vice_core::depth::{DepthMiss, DepthSample, DepthSource, Keyframe};
use vice_core::error::{DataError, DataResult};
use vice_core::frames::{Cloud as CloudFrame, Rigid, World};

use crate::ply::{self, PointSink};

/// Triangles of a scene, metres, in the frame of the scan.
#[derive(Clone)]
pub struct Mesh {
    triangles: TriMesh,
}

/// Points with their places kept, since faces name them by number.
#[derive(Default)]
struct Corners(Vec<Point3<f64>>);

impl PointSink for Corners {
    fn expect(&mut self, promised: u64, at_most: Option<u64>) -> DataResult<()> {
        // Reserved only as far as the length of the file backs the promise.
        let backed = at_most.map_or(0, |rows| rows.min(promised)) as usize;
        self.0
            .try_reserve_exact(backed)
            .map_err(|e| DataError::new(format!("{backed} vertices do not fit in memory")).because(e))
    }

    fn single(&mut self, point: [f32; 3]) -> DataResult<()> {
        self.double(point.map(f64::from))
    }

    fn double(&mut self, point: [f64; 3]) -> DataResult<()> {
        self.0.push(Point3::from(point));
        Ok(())
    }
}

impl Mesh {
    /// Reads a PLY file with faces, polygons of any number of corners.
    ///
    /// # Errors
    /// [`DataError`] with the byte or line if the file cannot be used, has no faces, or a face names a vertex that
    /// does not exist or is not finite.
    pub fn read(path: impl AsRef<Path>) -> DataResult<Self> {
        let path = path.as_ref();
        let (mut corners, mut faces) = (Corners::default(), Vec::new());
        ply::read_mesh(path, &mut corners, |face| {
            faces.push(face.to_vec());
            Ok(())
        })?;
        let faces = faces.iter().map(Vec::as_slice);
        Self::new(corners.0, faces).map_err(|e| e.at(path))
    }

    /// A mesh from vertices (metres) and polygons of places in their list, counted from 0.
    ///
    /// # Errors
    /// [`DataError`] if there are no faces, or one names a vertex that does not exist or is not finite.
    pub fn new<'a>(
        vertices: Vec<Point3<f64>>,
        faces: impl IntoIterator<Item = &'a [i64]>,
    ) -> DataResult<Self> {
        let mut triangles = Vec::new();
        let mut polygon = Vec::new();
        for (number, face) in faces.into_iter().enumerate() {
            polygon.clear();
            for corner in face {
                let vertex = usize::try_from(*corner).ok().and_then(|c| vertices.get(c));
                match vertex {
                    Some(v) if v.coords.iter().all(|x| x.is_finite()) => polygon.push((*corner as u32, *v)),
                    Some(_) => {
                        return Err(DataError::new(format!(
                            "vertex {corner} of face {number} is not finite"
                        )));
                    }
                    None => {
                        return Err(DataError::new(format!(
                            "face {number} names vertex {corner}, and there are {}",
                            vertices.len()
                        ))
                        .hint("vertices count from 0"));
                    }
                }
            }
            polygon::triangulate(&polygon, &mut triangles);
        }
        // A vertex of no face may be anything, but the tree of boxes must not see it.
        let finite =
            |v: Point3<f64>| if v.coords.iter().all(|x| x.is_finite()) { v } else { Point3::origin() };
        let vertices = vertices.into_iter().map(finite).map(|v| Vector::new(v.x, v.y, v.z)).collect();
        let triangles = TriMesh::new(vertices, triangles)
            .map_err(|e| DataError::new("the faces make no surface").because(e))?;
        Ok(Self { triangles })
    }

    /// Number of triangles, at least 1.
    #[expect(clippy::len_without_is_empty, reason = "a mesh is never empty")]
    pub fn len(&self) -> usize {
        self.triangles.indices().len()
    }
}

/// Depth from a mesh.
#[derive(Clone)]
pub struct MeshDepth {
    mesh: Arc<Mesh>,
    world_from_mesh: Rigid<World, CloudFrame>,
}

impl MeshDepth {
    /// Depth from a mesh that lies in the world.
    pub const fn new(mesh: Arc<Mesh>, world_from_mesh: Rigid<World, CloudFrame>) -> Self {
        Self { mesh, world_from_mesh }
    }
}

impl DepthSource for MeshDepth {
    fn name(&self) -> &str {
        "mesh"
    }

    fn needs_world(&self, _: &Floor) -> bool {
        true
    }

    fn depths(
        &self,
        keyframe: &Keyframe<'_>,
        pixels: &[Pixel],
    ) -> DataResult<Vec<Result<DepthSample, DepthMiss>>> {
        let Some(world_from_camera) = keyframe.world_from_camera else {
            return Ok(vec![Err(DepthMiss::NoAnchor); pixels.len()]);
        };
        let mesh_from_camera = self.world_from_mesh.inverse() * world_from_camera;
        let at = mesh_from_camera.translation();
        let depth = |px: &Pixel| {
            let ray = keyframe.camera.unproject(*px).map_err(|_| DepthMiss::OutsideModel)?;
            let direction = mesh_from_camera.rotate(&ray);
            let ray =
                Ray::new(Vector::new(at.x, at.y, at.z), Vector::new(direction.x, direction.y, direction.z));
            let z_m = self.mesh.triangles.cast_local_ray(&ray, f64::MAX, false);
            z_m.filter(|z| *z > 0.0).map(DepthSample::new).ok_or(DepthMiss::NoSurface)
        };
        Ok(pixels.par_iter().map(depth).collect())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{Scene, camera, grid, look};

    /// The scene as eight corners and six quadrilaterals a box.
    fn of(scene: &Scene) -> (Vec<Point3<f64>>, Vec<Vec<i64>>) {
        let (mut vertices, mut faces) = (Vec::new(), Vec::new());
        for sides in &scene.boxes {
            let first = vertices.len() as i64;
            for i in 0..8_usize {
                vertices.push(Point3::new(sides[i & 1][0], sides[i >> 1 & 1][1], sides[i >> 2][2]));
            }
            for face in [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]] {
                faces.push(face.iter().map(|c| c + first).collect());
            }
        }
        (vertices, faces)
    }

    #[test]
    fn every_pixel_is_exact_edges_included() {
        let scene = Scene::room();
        let (vertices, faces) = of(&scene);
        let mesh = Mesh::new(vertices, faces.iter().map(Vec::as_slice)).unwrap();
        assert_eq!(mesh.len(), 6 * 6 * 2);
        let source = MeshDepth::new(Arc::new(mesh), Rigid::identity());
        let camera = camera();
        let keyframe = look(&camera, [-2.0, -1.0, 1.6], [1.0, -0.3, 0.6]);
        let pixels = grid(&camera, 3);
        for (px, depth) in pixels.iter().zip(source.depths(&keyframe, &pixels).unwrap()) {
            let (z_m, exact) = (depth.unwrap().z_m, scene.depth(&keyframe, *px));
            assert!((z_m - exact).abs() < 1e-9, "{px:?}: {z_m} instead of {exact}");
        }
    }

    #[test]
    fn what_is_no_surface_is_said() {
        let triangle = |c: [f64; 3]| vec![Point3::new(1.0, 0.0, 2.0), Point3::new(0.0, 1.0, 2.0), c.into()];
        let new = |vertices, faces: &[&[i64]]| Mesh::new(vertices, faces.iter().copied()).map(|m| m.len());
        let error = |vertices, faces: &[&[i64]]| new(vertices, faces).unwrap_err().to_string();
        assert_eq!(new(triangle([-1.0, -1.0, 2.0]), &[&[0, 1, 2]]).unwrap(), 1);
        assert!(error(triangle([0.0; 3]), &[&[0, 1, 3]]).contains("face 0 names vertex 3, and there are 3"));
        assert!(error(triangle([0.0; 3]), &[&[0, 1, -1]]).contains("names vertex -1"));
        assert!(error(triangle([f64::NAN; 3]), &[&[0, 1, 2]]).contains("vertex 2 of face 0 is not finite"));
        assert!(error(triangle([0.0; 3]), &[]).contains("make no surface"));
        let mesh = Mesh::new(triangle([-1.0, -1.0, 2.0]), [&[0, 1, 2][..]]).unwrap();
        let source = MeshDepth::new(Arc::new(mesh), Rigid::identity());
        let camera = camera();
        let mut keyframe = look(&camera, [0.0; 3], [0.0, 0.01, 1.0]);
        let ahead = |k: &Keyframe<'_>| source.depths(k, &[Pixel::new(367.0, 248.0)]).unwrap()[0];
        assert!((ahead(&keyframe).unwrap().z_m - 2.0 * (1.0_f64 + 1e-4).sqrt()).abs() < 1e-2);
        keyframe = look(&camera, [0.0; 3], [0.0, 0.01, -1.0]);
        assert_eq!(ahead(&keyframe), Err(DepthMiss::NoSurface), "the surface is behind the camera");
        keyframe.world_from_camera = None;
        assert_eq!(ahead(&keyframe), Err(DepthMiss::NoAnchor));
    }
}
