#pragma once

#include <string>

#include "nephele/modeling/base/mesh.h"

namespace nephele::test {

/// The attribute of that name; null where there is none.
inline const MeshAttribute* find(const Mesh& mesh, const std::string& name) {
  for (const MeshAttribute& attribute : mesh.attributes)
    if (attribute.name == name) return &attribute;
  return nullptr;
}

}  // namespace nephele::test
