#pragma once

#include <span>
#include <string>
#include <vector>

#include "nephele/modeling/base/mesh.h"
#include "nephele/modeling/base/progress.h"

namespace nephele {

struct TransferOptions {
  /// Attributes of the reference to carry over; none: all but the normals of PLY files (nx, ny, nz), which
  /// belong to the shape.
  std::vector<std::string> names{};
};

/// The object with attributes of the reference, read where `images`, one for every position of `object`, lie
/// on the reference's surface, or near it. Attributes of the object stay unless one of the same name comes.
///
/// Attributes of vertices are interpolated in the triangle nearest to the image and become attributes of
/// vertices: nothing in them jumps between the corners of one vertex. Attributes of corners (texture
/// coordinates) are found face by face: the face takes the chart of the triangle nearest to the mean of its
/// images, and every corner its nearest point within what hangs together around there (see AttributeCharts),
/// so that no face mixes charts or is smeared over a seam; where a face lies across one, the corners beyond
/// end on it. Texture coordinates that repeat over a seam by whole numbers go on across it instead, and
/// may leave the unit square by less than a face. At a pole the number that means nothing there is the mean
/// of those of the face's other corners.
///
/// Vectors are copied as numbers and not turned. Values lie between those of the reference, but for what goes
/// on across a seam. Cost: about a microsecond per position and, where faces touch a seam, some tens per
/// face. All cores; the same result at any number of threads.
/// @throws Error if there are not as many images as positions, one is not finite, the reference has no faces,
/// lacks an attribute that is asked for (listing those it has), has none at all, or has values that are not
/// finite in one; Cancelled. Source: Tessendorf, Resolution Independent Volumes, 4.3 (attribute transfer).
Mesh transferAttributes(const Mesh& reference, const Mesh& object, std::span<const Vec3d> images,
                        const TransferOptions& options = {}, const Progress& progress = silent());

}  // namespace nephele
