#pragma once

#include <optional>
#include <vector>

#include "nephele/levelset/io/detail/ply_source.h"

namespace nephele::detail {

/// Face lists of a PLY file that may hold values of corners: the same number for every corner of every face.
class PlyCornerLists {
 public:
  /// Those of the element's properties that are lists of floats, without the ones that mean something else.
  PlyCornerLists(const PlyElement& element, std::optional<std::size_t> indices,
                 std::optional<std::size_t> texture);

  /// Reads property `i` of the current row; false if it is no such list.
  bool read(std::size_t i, const PlyProperty& property, PlySource& source);
  void closeFace(std::size_t cornerCount);
  /// Alpha of corners joins their colours. Lists of names that are taken are told apart as "<name>_corner".
  void addTo(Mesh& mesh);

 private:
  struct List {
    MeshAttribute attribute;
    std::vector<float> row;
    bool isWhole;
  };

  void joinAlpha(std::size_t cornerCount);

  std::vector<List> lists_;
  /// Per property of the element; -1: none.
  std::vector<int> listOf_;
};

}  // namespace nephele::detail
