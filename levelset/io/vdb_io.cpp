// Reading and writing volume files: choice of grids, messages, metadata. The parsing is in vdb_archive.cpp
// and nano_vdb.cpp.
#include "nephele/levelset/io/vdb_io.h"

#include <fmt/format.h>
#include <openvdb/io/File.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <set>

#include "nephele/levelset/io/detail/file_extension.h"
#include "nephele/levelset/io/detail/openvdb_grid.h"
#include "nephele/levelset/io/detail/vdb_check.h"
#include "nephele/levelset/io/detail/vdb_identifier.h"
#include "nephele/levelset/io/memory_file.h"
#include "nephele/levelset/io/output_file.h"
#include "nephele/modeling/base/printable.h"
#include "nephele/modeling/base/text_file.h"

namespace nephele {

namespace {

/// In one line: names inside damaged files may hold anything.
[[noreturn]] void failReading(const std::string& path, std::string reason) {
  std::replace_if(
      reason.begin(), reason.end(), [](char c) { return static_cast<unsigned char>(c) < ' '; }, ' ');
  throw Error(fmt::format("{}: {}", path, reason));
}

void checkReadable(const std::string& path) {
  requireWholeName(path);
  std::error_code error;
  const auto status = std::filesystem::status(path, error);
  if (!std::filesystem::exists(status)) failReading(path, "no such file");
  if (std::filesystem::is_directory(status)) failReading(path, "is a folder, not a volume");
  if (!std::ifstream(path).good()) failReading(path, "cannot be opened for reading");
  const std::uint64_t size = std::filesystem::file_size(path, error);
  if (error) failReading(path, error.message());
  if (size == 0) failReading(path, "the file is empty");
}

/// Turns what OpenVDB, NanoVDB and the standard library throw while reading into one line with the path.
template <class Body>
auto translateReadErrors(const std::string& path, const Body& body) {
  try {
    return body();
  } catch (const Error& e) {
    const std::string reason = e.what();
    failReading(path, reason.starts_with(path + ": ") ? reason.substr(path.size() + 2) : reason);
  } catch (const std::bad_alloc&) {
    failReading(path, "damaged, or too large for the memory of this machine");
  } catch (const openvdb::Exception& e) {
    // "IoError: what happened"
    const std::string reason = e.what();
    const std::size_t colon = reason.find("Error: ");
    failReading(path, colon == std::string::npos ? reason : reason.substr(colon + 7));
  } catch (const std::exception&) {
    failReading(path, "is damaged: it cannot be read");
  }
}

std::vector<openvdb::GridBase::Ptr> readGrids(const std::string& path, const detail::WantedGrid& wanted) {
  detail::initializeOpenVdb();
  if (const auto* held = MemoryFile::contentOf<std::vector<VdbGrid>>(path)) {
    std::vector<openvdb::GridBase::Ptr> grids;
    for (const VdbGrid& grid : *held) {
      wanted(*grid.impl().grid, grid.impl().grid->getName());
      grids.push_back(grid.impl().grid);
    }
    return grids;
  }
  checkReadable(path);
  return translateReadErrors(path, [&] {
    return detail::lowerExtension(path) == ".nvdb" ? detail::readNanoVdb(path, wanted)
                                                   : detail::readOpenVdb(path, wanted);
  });
}

std::vector<VdbGrid> wrapped(const std::vector<openvdb::GridBase::Ptr>& grids) {
  std::vector<VdbGrid> result;
  for (const auto& grid : grids) result.push_back(detail::wrapGrid(grid));
  return result;
}

bool isScalar(const openvdb::GridBase& grid) {
  return detail::valuesOf(grid) == VdbValues::scalar;
}

/// What readers refuse is not written.
void requireReadableTexts(const std::string& path, const openvdb::GridBase& grid) {
  const auto check = [&](std::string_view what, std::size_t size) {
    require(size <= std::size_t(detail::kLongestText),
            fmt::format("{}: grid {}: {} has {} bytes, where {} are the most", path,
                        detail::displayName(grid), what, size, detail::kLongestText));
  };
  for (auto entry = grid.beginMeta(); entry != grid.endMeta(); ++entry) {
    const std::string key = printable(entry->first, 80);
    check("a name in its metadata, '" + key + "',", entry->first.size());
    check(entry->first == openvdb::GridBase::META_GRID_NAME ? "its name" : "its metadata '" + key + "'",
          entry->second->size());
  }
}

}  // namespace

std::vector<VdbGrid> readVdbFile(const std::string& path) {
  return wrapped(readGrids(path, [](const auto&, const auto&) { return true; }));
}

std::vector<VdbGrid> readVdbHeaders(const std::string& path) {
  return wrapped(readGrids(path, [](const auto&, const auto&) { return false; }));
}

std::string listOf(const std::vector<VdbGrid>& grids) {
  std::string list;
  for (const VdbGrid& handle : grids)
    list += fmt::format("{}'{}' ({})", list.empty() ? "" : ", ", handle.impl().grid->getName(),
                        handle.impl().grid->valueType());
  return list.empty() ? "it holds no grid" : "it holds " + list;
}

VdbGrid readScalarGrid(const std::string& path, const std::string& name) {
  // Only the values of one grid are read.
  bool found = false;
  const auto wanted = [&](const openvdb::GridBase& type, const std::string& gridName) {
    const bool fits = !found && isScalar(type) && (name.empty() || gridName == name);
    found |= fits;
    return fits;
  };
  const auto grids = readGrids(path, wanted);
  for (const auto& grid : grids) {
    if (!name.empty() && grid->getName() != name) continue;
    if (isScalar(*grid))
      return translateReadErrors(path, [&] { return detail::wrapGrid(detail::toFloatGrid(grid)); });
    if (!name.empty())
      failReading(path, fmt::format("grid '{}' holds {} values; a scalar (float or double) grid is needed",
                                    name, grid->valueType()));
  }
  if (name.empty()) failReading(path, "no scalar (float or double) grid; " + listOf(wrapped(grids)));
  failReading(path, fmt::format("no grid '{}'; {}", name, listOf(wrapped(grids))));
}

std::array<VdbGrid, 3> readVectorGrid(const std::string& path, const std::string& name) {
  const auto grids =
      readGrids(path, [&](const auto&, const std::string& gridName) { return gridName == name; });
  for (const auto& grid : grids) {
    if (grid->getName() != name) continue;
    return translateReadErrors(path, [&] { return vectorComponents(detail::wrapGrid(grid)); });
  }
  failReading(path, fmt::format("no grid '{}'; {}", name, listOf(wrapped(grids))));
}

/// Values that 16 bit floats do not hold would become infinite, and those of a tiny level set all zeros.
void requireHalfHolds(const VdbGrid& grid) {
  constexpr float kMost = 65504, kApart = 6e-8f, kLeastBand = 1500 * kApart;
  const VdbGridInfo info = describe(grid);
  if (!info.halfFloat) return;
  const VdbValueRange range = valueRange(grid);
  const float most = std::max(-range.min, range.max);
  if (most > kMost)
    throw Error(
        fmt::format("the grid '{}' has values up to {:.6g}, and 16 bit floats end at {:g}; write 32 bit "
                    "floats",
                    printable(info.name), most, kMost));
  if (info.gridClass == VdbGridInfo::Class::levelSet && most > 0 && most < kLeastBand)
    throw Error(fmt::format(
        "the grid '{}' has distances up to {:.3g}, and 16 bit floats are {:g} apart; write 32 bit "
        "floats",
        printable(info.name), most, kApart));
}

void requireWritable(const std::vector<VdbGrid>& grids) {
  require(!grids.empty(), "no grid to write");
  std::set<std::string> names;
  for (const VdbGrid& each : grids) {
    const openvdb::GridBase& grid = *each.impl().grid;
    // Their values were not read and would be lost.
    require(detail::isCheckable(grid), fmt::format("the grid '{}' of {} cannot be written",
                                                   printable(grid.getName()), grid.valueType()));
    require(names.insert(grid.getName()).second,
            fmt::format("two grids are called '{}'", printable(grid.getName())));
    if (grid.transform().isLinear())
      if (const double edge = std::cbrt(std::abs(detail::matrixOf(grid.transform()).det()));
          !(edge >= detail::kLeastEdge))
        throw Error(
            fmt::format("the grid '{}' has voxels of {:.3g}, and files hold ones from {:g}; make them larger",
                        printable(grid.getName()), edge, detail::kLeastEdge));
    requireHalfHolds(each);
  }
}

void writeVdbFile(const std::string& path, const std::vector<VdbGrid>& grids,
                  const std::map<std::string, std::string>& metadata) {
  detail::initializeOpenVdb();
  namingFile(path, [&] { requireWritable(grids); });
  openvdb::GridPtrVec labelled;
  for (const VdbGrid& grid : grids) {
    // Shares the tree: only the metadata of what is written differs.
    openvdb::GridBase::Ptr copy = grid.impl().grid->copyGrid();
    for (const auto& [key, value] : metadata) {
      require(!key.empty(), path + ": metadata needs names");
      copy->removeMeta(key);
      copy->insertMeta(key, openvdb::StringMetadata(value));
    }
    requireReadableTexts(path, *copy);
    labelled.push_back(copy);
  }
  const auto kept = [&] {
    std::vector<VdbGrid> all;
    for (const auto& grid : labelled) all.push_back(detail::wrapGrid(grid));
    return all;
  };
  if (MemoryFile::put(path, kept)) return;
  OutputFile output(path);
  try {
    openvdb::io::File file(output.temporaryPath());
    file.setCompression(openvdb::io::COMPRESS_ACTIVE_MASK |
                        (openvdb::io::Archive::hasBloscCompression() ? openvdb::io::COMPRESS_BLOSC
                                                                     : openvdb::io::COMPRESS_ZIP));
    file.write(labelled);
    file.close();
    detail::identifyByContents(output.temporaryPath());
    // OpenVDB does not look whether its stream failed: what it wrote must hold what it announces.
    detail::readOpenVdb(output.temporaryPath(), [](const auto&, const auto&) { return false; });
  } catch (const std::bad_alloc&) {
    throw;
  } catch (const std::exception&) {
    throw Error(fmt::format("{}: cannot be written whole; the disk may be full", path));
  }
  output.commit();
}

}  // namespace nephele
