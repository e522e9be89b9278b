#pragma once

#include <string>
#include <vector>

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

  bool hasCloud() const { return kind == Kind::shape; }
  /// "mesh", "surface", "species", "volume" or "script".
  std::string word() const;
  /// Changes with every change of the file on disk.
  std::string stamp() const;

  /// @throws Error naming the path if there is no such file, or nobody can look at it.
  static LookSubject of(const std::string& path);
};

}  // namespace nephele::apps
