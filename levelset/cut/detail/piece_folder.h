#pragma once

#include <memory>
#include <string>
#include <vector>

#include "nephele/levelset/io/output_file.h"

namespace nephele::detail {

/// A folder that is filled with files that belong together, see `writePieces`.
///
/// A folder that is not there is filled under a temporary name beside its own and appears whole; in one that
/// is there, each file has a temporary name of its own. The destructor leaves everything as it was unless
/// `commit` was called.
class PieceFolder {
 public:
  /// @throws Error naming the path.
  explicit PieceFolder(std::string path);
  ~PieceFolder();
  PieceFolder(const PieceFolder&) = delete;
  PieceFolder& operator=(const PieceFolder&) = delete;

  /// Says which files there will be; the last one lists them all. @throws Error if others are in the way.
  void expect(const std::vector<std::string>& names);
  /// Where to write the file of that index; it may be there, empty. Safe to call from many threads, once for
  /// each.
  std::string temporary(std::size_t index);
  /// Removes what the folder's list names by now, and puts the new files in place: of two runs that end at
  /// once the files of one stay. @throws Error naming the path.
  void commit();

  /// Where the list is.
  static constexpr const char* kList = "pieces.json";

 private:
  std::string pathOf(const std::string& name) const;
  void makeFolder();
  void requireNoneInTheWay() const;

  std::string path_, target_;
  /// What the folder is called until it is complete; empty if it was there.
  std::string staging_;
  std::unique_ptr<OpenOutput> openStaging_;
  std::vector<std::unique_ptr<OpenOutput>> openFiles_;
  /// Folders around it that were not there, outermost first.
  std::vector<std::string> made_;
  /// Files that the list of an earlier cut names.
  std::vector<std::string> listed_;
  std::vector<std::string> names_;
  std::vector<std::unique_ptr<OutputFile>> outputs_;
  bool committed_ = false;
};

}  // namespace nephele::detail
