#pragma once

#include <stdexcept>
#include <string>

#include "nephele/modeling/base/mesh.h"

namespace nephele::test {

/// The attribute of that name; null where there is none.
inline const MeshAttribute* find(const Mesh& mesh, const std::string& name) {
  for (const MeshAttribute& attribute : mesh.attributes)
    if (attribute.name == name) return &attribute;
  return nullptr;
}

/// The same where there must be one. @throws std::runtime_error.
inline const MeshAttribute& attributeOf(const Mesh& mesh, const std::string& name) {
  if (const MeshAttribute* attribute = find(mesh, name)) return *attribute;
  throw std::runtime_error("no attribute " + name);
}

/// That of a temporary lives on.
inline MeshAttribute attributeOf(const Mesh&& mesh, const std::string& name) {
  return attributeOf(mesh, name);
}

}  // namespace nephele::test
