#pragma once

#include <string>
#include <vector>

#include "apps/look/settings.h"
#include "apps/look/shown.h"

namespace nephele::apps {

/// What is looked at.
struct LookSubject {
  enum class Kind {
    shape,   ///< A mesh, a level set or a shape of a species: a cloud is grown on it.
    volume,  ///< A density in a file.
    script,  ///< A script that declares one.
  };

  Kind kind = Kind::shape;
  /// One file, or none for a species of cloud.
  std::string path{};

  /// A mesh whose attributes may be carried to that of `path`, or none.
  std::string reference{};

  bool hasCloud() const { return kind == Kind::shape; }
  /// "mesh", "surface", "species", "volume" or "script".
  std::string word() const;
  /// Changes with every change of the file on disk.
  std::string stamp() const;

  /// Settings of `cloud` that grow it: what nobody has given grows on a shape of its own.
  LookSettings cloudSettings(const LookSettings& settings) const;

  /// What can be shown of it.
  std::vector<LookShow::What> views() const;

  /// Of no file, of one, or of two meshes: what attributes are carried from, and to.
  /// @throws Error naming the path if there is no such file, or nobody can look at it.
  static LookSubject of(const std::vector<std::string>& paths);
};

}  // namespace nephele::apps
