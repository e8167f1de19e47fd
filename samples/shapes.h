// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <subvol/mesh/volume_mesh.h>
#include <subvol/surface/point_cloud.h>
#include <subvol/surface/triangle_mesh.h>

#include <string>
#include <vector>

namespace subvol::samples {

/// A surface to reproduce and a coarse template near it.
struct Sample {
  std::string name;
  TriangleMesh target;       ///< closed, outward
  VolumeMesh template_mesh;  ///< hexes; passes `validate`
};

/// A torus with bumps: 12 sections of a tube, 5 hexes each (one inside, four around it).
Sample torus_sample();

/// A ball with bumps: one hex inside, six around it.
Sample ball_sample();

/// A curved L-shaped bracket with sharp edges: 10 hexes of a grid, all creases tagged.
Sample bracket_sample();

/// All of the above.
std::vector<Sample> all_samples();

/// A rippled bowl to grow shells on: 5 n^2 quads, open at the top, outward.
PolygonMesh bowl_surface(int n = 12);

/// A quarter of a plate with a hole, for a static analysis: 2 x 1 x 0.02, its hole of radius 0.25 around the origin.
/// Quads with the groups symmetry_x, symmetry_y and symmetry_z (where x, y or z is 0), hole, loaded (x = 2), side and
/// top; outward.
PolygonMesh plate_surface();

/// An assembly of four solids that touch, each with its name: a block on a sheet of cork on a plate, with a pin on top.
///
/// In millimeters: plate 60 x 60 x 10, cork and block 40 x 40 x 20, pin of 24 sides with radius 8 and height 20; the
/// plate's lower side is at z = 0. Quads; each solid is closed and outward.
PolygonMesh mount_surface();

/// A connecting rod with two bores: 2.8 long, 0.3 thick. Quads with the groups small_bore, large_bore, side, bottom and
/// top; all edges between them are sharp; outward.
PolygonMesh rod_surface();

/// A starfish of five arms, smooth; outward.
TriangleMesh starfish_surface();

/// A ball of 448 hexes, the vertices inside thrown about: four in five cells are inverted. The same one everywhere.
VolumeMesh tangled_ball();

/// Points scattered evenly at random over a surface, each moved by up to `noise` along every axis: the same ones
/// everywhere.
PointCloud scattered_points(const TriangleMesh& surface, std::size_t count, double noise = 0);

/// Points as the text of an .xyz file.
std::string xyz_text(const PointCloud& cloud);

/// A triangle mesh as the text of an .off file.
std::string off_text(const TriangleMesh& mesh);

}  // namespace subvol::samples
