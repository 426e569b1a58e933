//! Surroundings made of triangles: bowls, funnels, terrain. They do not move, so they need no volume and may be open.

use glam::DVec3;

use super::bounding_tree::BoundingTree;
use super::bounds::Bounds;
use super::error::ShapeError;
use super::exact::{side, twice_area};
use super::surface::{Surface, SurfaceEdge};

/// How the surface bends at an edge, seen from the front, where triangles are counter-clockwise.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Fold {
    /// A ridge: can be touched from the front.
    Convex,
    /// Both triangles lie exactly in one plane: nothing touches the edge without touching a triangle.
    Flat,
    /// A valley: can be touched from the back only.
    Concave,
    /// The rim of the surface, with one triangle only, or with two that lie on each other: can be touched from both
    /// sides.
    Boundary,
}

/// A triangle of a mesh.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MeshTriangle {
    /// Its corners, counter-clockwise seen from the front.
    pub vertices: [u32; 3],
    /// Its edges: from corner 0 to 1, 1 to 2, 2 to 0.
    pub edges: [u32; 3],
    /// Unit normal to the front.
    pub normal: DVec3,
}

/// An edge of a mesh.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct MeshEdge {
    /// Its ends, the smaller index first.
    pub vertices: [u32; 2],
    /// The triangles on its left and right, seen from the front along the edge.
    pub triangles: [Option<u32>; 2],
    /// How the surface bends here. Decided by an exact sign: the slightest ridge is convex.
    pub fold: Fold,
}

impl MeshEdge {
    /// Whether a convex body in front of the surface can touch this edge alone.
    pub fn touchable_from_front(&self) -> bool {
        matches!(self.fold, Fold::Convex | Fold::Boundary)
    }

    /// Whether a convex body behind the surface can touch this edge alone.
    pub fn touchable_from_back(&self) -> bool {
        matches!(self.fold, Fold::Concave | Fold::Boundary)
    }
}

/// A surface of triangles, open or closed. Where it is open both sides are surfaces; which of them bodies are on is
/// theirs to know.
#[derive(Clone, Debug, PartialEq)]
pub struct TriangleMesh {
    /// Corners (m): of the vertices given those that triangles use, without repetition, in the order given.
    pub vertices: Vec<DVec3>,
    /// Triangles, in the order given.
    pub triangles: Vec<MeshTriangle>,
    /// Edges, sorted by their vertices.
    pub edges: Vec<MeshEdge>,
    /// The edges at vertex k are `edges_at[edges_from[k]..edges_from[k + 1]]`, sorted.
    edges_from: Vec<u32>,
    edges_at: Vec<u32>,
    tree: BoundingTree,
}

impl TriangleMesh {
    /// A mesh of vertices (m) and triangles. Vertices at the same place (equal bit by bit) are one.
    ///
    /// # Errors
    /// A mesh that is empty or too large, coordinates that are not finite, triangles that name vertices that do not
    /// exist or have no area, more than two triangles at an edge, or two that are oriented differently.
    pub fn new(vertices: &[DVec3], triangles: &[[u32; 3]]) -> Result<Self, ShapeError> {
        let surface = Surface::new(vertices, triangles)?;
        let edges: Vec<MeshEdge> = surface.edges.iter().map(|edge| mesh_edge(&surface, edge)).collect();
        let triangles = mesh_triangles(&surface);
        let boxes: Vec<Bounds> =
            (0..triangles.len() as u32).map(|triangle| Bounds::around(surface.corners(triangle))).collect();
        let mut at: Vec<[u32; 2]> = (0..).zip(&edges).flat_map(|(k, edge)| edge.vertices.map(|v| [v, k])).collect();
        at.sort_unstable();
        let mut edges_from = vec![0; surface.vertices.len() + 1];
        at.iter().for_each(|&[vertex, _]| edges_from[vertex as usize + 1] += 1);
        for k in 0..surface.vertices.len() {
            edges_from[k + 1] += edges_from[k];
        }
        Ok(Self {
            vertices: surface.vertices,
            triangles,
            edges,
            edges_from,
            edges_at: at.into_iter().map(|[_, edge]| edge).collect(),
            tree: BoundingTree::new(&boxes),
        })
    }

    /// The corners of a triangle (m).
    pub fn corners(&self, triangle: u32) -> [DVec3; 3] {
        self.triangles[triangle as usize].vertices.map(|k| self.vertices[k as usize])
    }

    /// Distance (m) of the farthest vertex from the origin.
    pub fn reach(&self) -> f64 {
        self.vertices.iter().map(|vertex| vertex.length()).fold(0.0, f64::max)
    }

    /// The edges at a vertex, sorted.
    pub fn edges_at(&self, vertex: u32) -> &[u32] {
        let (from, to) = (self.edges_from[vertex as usize], self.edges_from[vertex as usize + 1]);
        &self.edges_at[from as usize..to as usize]
    }

    /// Whether a convex body in front may touch this vertex alone: some edge at it is a ridge or the rim. (Between
    /// valleys only, the free space is a convex cone, and the body touches its sides.)
    pub fn vertex_touchable_from_front(&self, vertex: u32) -> bool {
        self.edges_at(vertex).iter().any(|&edge| self.edges[edge as usize].touchable_from_front())
    }

    /// Whether a convex body behind may touch this vertex alone.
    pub fn vertex_touchable_from_back(&self, vertex: u32) -> bool {
        self.edges_at(vertex).iter().any(|&edge| self.edges[edge as usize].touchable_from_back())
    }

    /// Whether the surface has no rim.
    pub fn is_closed(&self) -> bool {
        self.edges.iter().all(|edge| !edge.triangles.contains(&None))
    }

    /// The box around the mesh.
    pub fn bounds(&self) -> Bounds {
        self.tree.bounds()
    }

    /// The triangles whose boxes overlap `bounds`, sorted.
    pub fn near(&self, bounds: &Bounds) -> Vec<u32> {
        let mut found = Vec::new();
        self.gather_near(bounds, &mut found);
        found
    }

    /// The same, written over what `found` holds.
    pub fn gather_near(&self, bounds: &Bounds, found: &mut Vec<u32>) {
        found.clear();
        self.tree.visit(bounds, |triangle| {
            if Bounds::around(self.corners(triangle)).overlaps(bounds) {
                found.push(triangle);
            }
        });
        found.sort_unstable();
    }
}

fn mesh_edge(surface: &Surface, edge: &SurfaceEdge) -> MeshEdge {
    let fold = match edge.triangles {
        [Some(left), Some(right)] => fold(surface, edge, left, right),
        _ => Fold::Boundary,
    };
    MeshEdge { vertices: edge.vertices, triangles: edge.triangles, fold }
}

fn fold(surface: &Surface, edge: &SurfaceEdge, left: u32, right: u32) -> Fold {
    let [a, b, c] = surface.corners(left);
    let height = side(a, b, c, surface.opposite(right, edge));
    if height < 0.0 {
        return Fold::Convex;
    }
    if height > 0.0 {
        return Fold::Concave;
    }
    let [p, q, r] = surface.corners(right);
    if twice_area(a, b, c).dot(twice_area(p, q, r)) > 0.0 { Fold::Flat } else { Fold::Boundary }
}

fn mesh_triangles(surface: &Surface) -> Vec<MeshTriangle> {
    let edge_between = |a: u32, b: u32| {
        let ends = [a.min(b), a.max(b)];
        surface.edges.partition_point(|edge| edge.vertices < ends) as u32
    };
    let triangle = |&vertices: &[u32; 3]| {
        let [a, b, c] = vertices;
        let [p, q, r] = vertices.map(|k| surface.vertices[k as usize]);
        MeshTriangle {
            vertices,
            edges: [edge_between(a, b), edge_between(b, c), edge_between(c, a)],
            normal: twice_area(p, q, r).normalize(),
        }
    };
    surface.triangles.iter().map(triangle).collect()
}
