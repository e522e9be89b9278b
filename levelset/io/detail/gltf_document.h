#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <string_view>
#include <vector>

#include "nephele/levelset/io/detail/mesh_io_private.h"

namespace nephele::detail {

/// Elements of a glTF accessor: `components` numbers each.
struct GltfValues {
  std::size_t count = 0;
  std::size_t components = 0;
  std::vector<double> numbers;

  double at(std::size_t element, std::size_t component) const {
    return numbers[element * components + component];
  }
};

/// The JSON part and the buffers of a glTF file. A hostile file must end in a message: every offset, count
/// and index is held against the bytes that are there before it is used, by the functions below as well.
class GltfDocument {
 public:
  using json = nlohmann::json;

  /// Reads the container, text or binary, and all buffers. Keeps a reference to `file`.
  /// @throws Error; json::exception where values have the wrong type.
  explicit GltfDocument(const MeshFile& file);

  const json& root() const { return root_; }
  const json& member(const json& object, const char* key) const;
  /// The list under `key`, empty if there is none.
  const json& list(const json& object, const char* key) const;
  /// The whole number >= 0 under `key`.
  std::size_t size(const json& object, const char* key) const;
  std::size_t size(const json& object, const char* key, std::size_t fallback) const;
  /// Entry `index` of a list of the root.
  const json& item(const char* listName, std::size_t index) const;
  /// The elements of accessor `index`: sparse ones filled in, normalised ones in -1..1. Refused once all that
  /// were read are more than a scene of that size can need: instances are written out.
  GltfValues readAccessor(std::size_t index);

 private:
  void parse();
  void checkExtensions() const;
  void loadBuffers();
  /// Of a buffer in a file of its own.
  std::string pathOf(const std::string& uri) const;
  const char* window(std::size_t viewIndex, std::size_t offset, std::size_t count, std::size_t elementSize,
                     std::size_t& stride) const;

  const MeshFile& file_;
  json root_;
  std::string_view binary_;
  std::vector<std::string> buffers_;
  std::size_t elementsLeft_ = 0;
};

}  // namespace nephele::detail
