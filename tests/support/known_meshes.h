#pragma once

#include <ostream>

namespace nephele::test {

/// What is known of a mesh of the shared test data, after merging equal positions. All numbers are from its
/// manifest (MANIFEST.json, "check.welded"), measured by another program and, where CGAL reads the file,
/// agreeing with CGAL.
struct KnownMesh {
  const char* name;
  int vertices, faces, triangles;
  long euler;
  int components, boundaryEdges, boundaryLoops, nonManifoldEdges, nonManifoldVertices, misorientedEdges;
  int duplicateFaces, zeroAreaTriangles;
  int selfIntersections;  ///< Pairs; -1 where not known or the mesh is large.
  double volume;          ///< Signed; about the origin, so for open meshes not ours.
  bool hasUv;
};

inline std::ostream& operator<<(std::ostream& stream, const KnownMesh& mesh) {
  return stream << mesh.name;
}

// clang-format off
inline constexpr KnownMesh kKnownMeshes[] = {
    {"meshes/adis16480_cad_ascii.stl", 3672, 7436, 7436, -46, 1, 0, 0, 0, 0, 0, 0, 0, 0, 2.81924702e-05, false},
    {"meshes/armadillo_29k.obj", 14587, 29170, 29170, 2, 1, 0, 0, 0, 0, 0, 0, 0, 0, 0.0683228688, false},
    {"meshes/boat_uv.obj", 16210, 32416, 32416, 2, 1, 0, 0, 0, 0, 0, 0, 0, 0, 11.9177357, true},
    {"meshes/bob_uv_genus1.obj", 5344, 10688, 10688, 0, 1, 0, 0, 0, 0, 0, 0, 0, 0, 0.688918049, true},
    {"meshes/box_ascii.stl", 8, 12, 12, 2, 1, 0, 0, 0, 0, 0, 0, 0, 0, 1000, false},
    {"meshes/box_binary.stl", 8, 12, 12, 2, 1, 0, 0, 0, 0, 0, 0, 0, 0, 1000, false},
    {"meshes/box_textured.glb", 8, 12, 12, 2, 1, 0, 0, 0, 0, 0, 0, 0, 0, 1, true},
    {"meshes/bunny_28k_uv.ply", 13934, 27864, 27864, 2, 1, 0, 0, 0, 0, 0, 0, 0, 0, 0.000751480523, true},
    {"meshes/bunny_60k.obj", 29834, 59664, 59664, 2, 1, 0, 0, 0, 0, 0, 0, 0, -1, 0.745450754, false},
    {"meshes/bunny_7k.obj", 3301, 6598, 6598, 2, 1, 0, 0, 0, 0, 0, 0, 0, 0, 0.749334108, false},
    {"meshes/cube_binary_crlf_header.ply", 8, 12, 12, 2, 1, 0, 0, 0, 0, 0, 0, 0, 0, 1, false},
    {"meshes/cube_quads_ascii.ply", 8, 6, 12, 2, 1, 0, 0, 0, 0, 0, 0, 0, 0, 1, false},
    {"meshes/cube_uv.obj", 26, 48, 48, 2, 1, 0, 0, 0, 0, 0, 0, 0, 0, 8, true},
    {"meshes/dodecahedron_ngons.obj", 20, 12, 36, 2, 1, 0, 0, 0, 0, 0, 0, 0, 0, 2.78516052, false},
    {"meshes/double_torus_genus2.obj", 3070, 6144, 6144, -2, 1, 0, 0, 0, 0, 0, 0, 0, 0, 0.66876154, false},
    {"meshes/drop_uv.obj", 3002, 6000, 6000, 2, 1, 0, 0, 0, 0, 0, 0, 0, 0, 1156.63351, true},
    {"meshes/duck.glb", 2108, 4212, 4212, 2, 1, 0, 0, 0, 0, 0, 0, 0, 4, 1.19579918, true},
    {"meshes/fandisk_13k.obj", 6475, 12946, 12946, 2, 1, 0, 0, 0, 0, 0, 0, 0, 0, 20.2433749, false},
    {"meshes/fertility_genus4.off", 4494, 9000, 9000, -6, 1, 0, 0, 0, 0, 0, 0, 0, 0, 432186.019, false},
    {"meshes/fox_binary.ply", 313, 622, 622, 2, 1, 0, 0, 0, 0, 0, 0, 0, 0, 28386.6958, false},
    {"meshes/hexa_sphere_ngons.obj", 1760, 882, 3516, 2, 1, 0, 0, 0, 0, 0, 0, 0, 0, 4.11421365, false},
    {"meshes/knot_quads.obj", 1440, 1440, 2880, 0, 1, 0, 0, 0, 0, 0, 0, 0, 0, 1057307.77, true},
    {"meshes/knot_tiled_uv.obj", 1440, 2880, 2880, 0, 1, 0, 0, 0, 0, 0, 0, 0, 0, 1053504.83, true},
    {"meshes/koala_100k.obj", 49999, 99994, 99994, 2, 1, 0, 0, 0, 0, 0, 0, 0, -1, 57.0894316, false},
    {"meshes/multi_uv_box.glb", 8, 12, 12, 2, 1, 0, 0, 0, 0, 0, 0, 0, 0, 8.00000036, true},
    {"meshes/negative_indices_uv.obj", 8, 6, 12, 2, 1, 0, 0, 0, 0, 0, 0, 0, 0, 8, true},
    {"meshes/rocker_arm_genus1.obj", 10044, 20088, 20088, 0, 1, 0, 0, 0, 0, 0, 0, 0, 0, 0.0425136236, false},
    {"meshes/scorpion_13k.obj", 6315, 12626, 12626, 2, 1, 0, 0, 0, 0, 0, 0, 0, 0, 12.1785358, false},
    {"meshes/sphere_1k.obj", 642, 1280, 1280, 2, 1, 0, 0, 0, 0, 0, 0, 0, 0, 4.15268487, false},
    {"meshes/sphere_ico_mirrored_uv.obj", 162, 320, 320, 2, 1, 0, 0, 0, 0, 0, 0, 0, 0, 4.04700593, true},
    {"meshes/sphere_uv.obj", 382, 760, 760, 2, 1, 0, 0, 0, 0, 0, 0, 0, 0, 1.40453959, true},
    {"meshes/spot_control_quads_uv.obj", 188, 180, 372, 2, 1, 0, 0, 0, 0, 0, 0, 0, 26, 0.844791062, true},
    {"meshes/spot_quads_uv.obj", 2930, 2928, 5856, 2, 1, 0, 0, 0, 0, 0, 0, 0, 0, 0.71788651, true},
    {"meshes/spot_remesh_23k.obj", 11533, 23062, 23062, 2, 1, 0, 0, 0, 0, 0, 0, 0, 0, 0.687986265, false},
    {"meshes/spot_uv.obj", 2930, 5856, 5856, 2, 1, 0, 0, 0, 0, 0, 0, 0, 0, 0.718258788, true},
    {"meshes/torus_genus1.obj", 2304, 4608, 4608, 0, 1, 0, 0, 0, 0, 0, 0, 0, 0, 1.2187845, false},
    {"meshes/torus_quads_uv.obj", 32, 32, 64, 0, 1, 0, 0, 0, 0, 0, 0, 0, 0, 2.82842159, true},
    {"meshes/vase_binary.stl", 5457, 10910, 10910, 2, 1, 0, 0, 0, 0, 0, 0, 0, 0, 111616.866, false},
    {"defective/bunny_open_5_holes_ascii.ply", 34834, 69451, 69451, -3, 1, 223, 5, 0, 0, 0, 0, 0, -1, 0.000770056524, false},
    {"defective/camel_head_open.off", 11381, 22704, 22704, 1, 1, 56, 1, 0, 0, 0, 0, 0, 5, 0.0859083349, false},
    {"defective/capsule_200_degenerate_uv.obj", 5002, 10200, 10200, 202, 1, 0, 0, 200, 0, 0, 0, 200, 0, 7.32143145, true},
    {"defective/conrod_mixed_orientation.stl", 3223, 6442, 6442, 5, 1, 0, 0, 3, 0, 5149, 3, 0, 13, 7.74837234, false},
    {"defective/cube_with_fold.ply", 26, 48, 48, 2, 1, 0, 0, 0, 0, 0, 0, 0, 11, 8, false},
    {"defective/cubes_29_components.obj", 8584, 17052, 17052, 58, 29, 0, 0, 0, 0, 0, 0, 0, 0, 28.9999738, false},
    {"defective/degenerate_faces.obj", 5, 4, 4, 2, 1, 4, 1, 1, 0, 0, 0, 1, 0, -2.82820033e-07, false},
    {"defective/generic_twin_12_parts.obj", 9874, 19704, 19704, 22, 12, 0, 0, 0, 0, 0, 0, 0, 3, 101590.877, false},
    {"defective/guitar_94_parts.ply", 4500, 8660, 8660, 170, 94, 0, 0, 0, 0, 0, 0, 0, 8166, 396759.691, false},
    {"defective/horse_97k_inside_out_be.ply", 48485, 96966, 96966, 2, 1, 0, 0, 0, 0, 0, 0, 0, -1, -0.000263418277, false},
    {"defective/hourglass_nonmanifold_vertex.obj", 23, 40, 40, 3, 1, 0, 0, 0, 1, 0, 0, 0, 0, 5.0721917, false},
    {"defective/human_neutral_uv_open.obj", 10475, 20908, 20908, 5, 3, 32, 1, 0, 0, 0, 0, 0, 326, 0.076067087, true},
    {"defective/joined_tetrahedra_nonmanifold.obj", 5, 8, 8, 4, 1, 0, 0, 3, 0, 0, 1, 0, 0, 0.8660254, false},
    {"defective/many_small_holes.ply", 2004, 3524, 3524, -36, 1, 556, 32, 0, 6, 0, 0, 0, 0, -0.000677451772, false},
    {"defective/moebius_strip_quads.obj", 280, 224, 448, 0, 1, 112, 1, 0, 0, 4, 0, 0, 0, 22.3240931, false},
    {"defective/noisy_sphere_inside_out_quads.obj", 482, 512, 960, 2, 1, 0, 0, 0, 0, 0, 0, 0, 0, -4.11861484, false},
    {"defective/nonmanifold_edge.obj", 8, 3, 6, 1, 1, 9, 1, 1, 0, 0, 0, 0, 0, 0, true},
    {"defective/nonmanifold_vertex.obj", 7, 2, 4, 1, 1, 8, 1, 0, 1, 0, 0, 0, 0, 0, true},
    {"defective/nonoriented_edge.obj", 6, 2, 4, 1, 1, 6, 1, 0, 0, 1, 0, 0, 0, 0, true},
    {"defective/openscad_nonmanifold.obj", 658, 1442, 1442, -45, 1, 0, 0, 18, 34, 0, 3, 1, 7542, 451.960155, false},
    {"defective/planar_mesh_nonmanifold.ply", 1403, 2553, 2553, -18, 1, 290, 17, 1, 3, 0, 0, 0, 0, -1583.93358, false},
    {"defective/plane_27_holes.obj", 8519, 16747, 16747, -25, 1, 341, 27, 0, 0, 0, 0, 0, 0, 29.1390987, false},
    {"defective/rounded_cube_zero_area_uv.obj", 864, 1724, 1724, 2, 1, 0, 0, 0, 0, 0, 0, 0, 0, 6866.56484, true},
    {"defective/self_intersecting_closed.obj", 8582, 17160, 17160, 2, 1, 0, 0, 0, 0, 0, 0, 0, 338, 0.147953423, false},
    {"defective/single_triangle_ascii.stl", 3, 1, 1, 1, 1, 3, 1, 0, 0, 0, 0, 0, 0, 0, false},
    {"defective/sliver_tet_5005_unused.ply", 4, 4, 4, 2, 1, 0, 0, 0, 0, 0, 0, 0, 0, 6.89657197e-11, false},
    {"defective/spider_ascii.stl", 722, 1368, 1368, 86, 18, 72, 6, 16, 4, 10, 36, 56, 317, 10.1371384, false},
    {"defective/suzanne_open_quads.obj", 505, 500, 968, 0, 1, 42, 4, 0, 2, 0, 0, 0, 98, 2.28317906, false},
    {"defective/teapot_open_seams.obj", 3241, 6320, 6320, 1, 3, 160, 6, 0, 1, 0, 0, 0, 161, 25.7701061, false},
    {"defective/thingi_42400_degenerate.stl", 5500, 11036, 11036, -18, 1, 0, 0, 0, 0, 0, 0, 3, 9, 139.075363, false},
    {"defective/three_tori_components.obj", 864, 1728, 1728, 0, 3, 0, 0, 0, 0, 0, 0, 0, 0, 167.714706, false},
    {"defective/triangle_soup_100.stl", 300, 100, 100, 100, 100, 300, 100, 0, 0, 0, 0, 0, 1248, -0.0486174471, false},
    {"defective/triple_vierbein_nonmanifold.obj", 75, 108, 108, 1, 1, 60, 1, 20, 0, 3, 0, 0, 0, 7.49525679, false},
    {"defective/truck_many_defects.obj", 2956, 4770, 4770, -96, 50, 1388, 144, 54, 55, 64, 0, 0, 424, -0.0575449888, false},
    {"defective/trumpet_nonmanifold_quads.obj", 11800, 11362, 23696, 60, 30, 0, 0, 108, 0, 0, 3, 0, 3154, 1845170.82, false},
    {"defective/two_overlapping_spheres.obj", 1060, 2112, 2112, 4, 2, 0, 0, 0, 0, 0, 0, 0, 147, 1.02575523, false},
    {"big/igea_1075k.ply", 537374, 1074744, 1074744, 2, 1, 0, 0, 0, 0, 0, 0, 0, -1, 0.000278524462, false},
    {"big/igea_269k_tristrips.ply", 134345, 268686, 268686, 2, 1, 0, 0, 0, 0, 0, 0, 0, -1, 0.000278524462, false},
    {"big/itokawa_197k.ply", 98306, 196608, 196608, 2, 1, 0, 0, 0, 0, 0, 0, 0, -1, 0.0177364525, false},
    {"big/turbine_blade_199k.ply", 99519, 199034, 199034, 2, 1, 0, 0, 0, 0, 0, 0, 0, -1, 3676.47114, false},
};
// clang-format on

}  // namespace nephele::test
