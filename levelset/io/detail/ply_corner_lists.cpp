#include "nephele/levelset/io/detail/ply_corner_lists.h"

#include <algorithm>
#include <set>

namespace nephele::detail {
namespace {

constexpr std::size_t kMostWidth = 1 << 20;

}  // namespace

PlyCornerLists::PlyCornerLists(const PlyElement& element, std::optional<std::size_t> indices,
                               std::optional<std::size_t> texture) {
  listOf_.resize(element.properties.size(), -1);
  for (std::size_t i = 0; i < element.properties.size(); ++i) {
    const PlyProperty& property = element.properties[i];
    if (!property.isList() || i == indices || i == texture) continue;
    if (property.type != PlyType::float32 && property.type != PlyType::float64) continue;
    listOf_[i] = static_cast<int>(lists_.size());
    lists_.push_back({{property.name, MeshAttribute::Domain::corner, 0, {}}, {}, true});
  }
}

bool PlyCornerLists::read(std::size_t i, const PlyProperty& property, PlySource& source) {
  if (listOf_[i] < 0 || !lists_[static_cast<std::size_t>(listOf_[i])].isWhole) return false;
  std::vector<float>& row = lists_[static_cast<std::size_t>(listOf_[i])].row;
  row.resize(source.length(property));
  for (float& value : row) value = static_cast<float>(source.value(property.type));
  return true;
}

void PlyCornerLists::closeFace(std::size_t cornerCount) {
  for (List& list : lists_) {
    if (!list.isWhole) continue;
    std::vector<float>& values = list.attribute.values;
    const std::size_t width = list.row.size() / cornerCount;
    if (values.empty()) list.attribute.width = static_cast<int>(std::min<std::size_t>(width, kMostWidth));
    list.isWhole = !list.row.empty() && list.row.size() % cornerCount == 0 &&
                   width == static_cast<std::size_t>(list.attribute.width);
    if (list.isWhole)
      values.insert(values.end(), list.row.begin(), list.row.end());
    else
      values = {};
    list.row.clear();
  }
}

void PlyCornerLists::addTo(Mesh& mesh) {
  std::erase_if(lists_, [&](const List& list) {
    const auto width = static_cast<std::size_t>(list.attribute.width);
    return !list.isWhole || width == 0 || list.attribute.values.size() != width * mesh.corners.size();
  });
  joinAlpha(mesh.corners.size());
  std::set<std::string> names;
  for (const MeshAttribute& a : mesh.attributes) names.insert(a.name);
  for (List& list : lists_) {
    if (names.contains(list.attribute.name)) list.attribute.name += "_corner";
    if (names.insert(list.attribute.name).second) mesh.attributes.push_back(std::move(list.attribute));
  }
}

void PlyCornerLists::joinAlpha(std::size_t cornerCount) {
  const auto named = [&](const char* name, int width) {
    return std::ranges::find_if(lists_, [&](const List& list) {
      return list.attribute.name == name && list.attribute.width == width;
    });
  };
  const auto color = named("color", 3), alpha = named("alpha", 1);
  if (color == lists_.end() || alpha == lists_.end()) return;
  std::vector<float> values;
  values.reserve(4 * cornerCount);
  for (std::size_t c = 0; c < cornerCount; ++c) {
    for (std::size_t k = 0; k < 3; ++k) values.push_back(color->attribute.values[3 * c + k]);
    values.push_back(alpha->attribute.values[c]);
  }
  color->attribute.width = 4;
  color->attribute.values = std::move(values);
  lists_.erase(alpha);
}

}  // namespace nephele::detail
