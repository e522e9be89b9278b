#pragma once

#include <cstdint>
#include <map>
#include <utility>
#include <vector>

#include "nephele/levelset/cut/cut.h"

/// What every cut says of its pieces.
namespace nephele::detail {

/// The group of the faces that knives made.
inline constexpr const char* kInsideGroup = "inside";

/// Sets mass and box from the mesh.
void measure(Piece& piece);

/// By pairs of pieces, the lower one first.
using ContactAreas = std::map<std::pair<std::uint32_t, std::uint32_t>, double>;
/// Sets the neighbours of all pieces.
void setNeighbours(std::vector<Piece>& pieces, const ContactAreas& areas);

/// Sets which pieces are closed. @throws Cancelled.
void checkClosed(std::vector<Piece>& pieces, const Progress& progress);

/// Sets the sum of the volumes and the number of codes.
void sumUp(Pieces& pieces);

}  // namespace nephele::detail
