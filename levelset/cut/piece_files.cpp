// Files of pieces.
//
// The text of every piece is made once, on all cores, for its own file and for the file of all; only the
// numbers of points in faces differ there. Outer and inner faces have materials, so that programs which know
// no groups tell them apart; where the source has materials, its outer faces keep them.
#include "nephele/levelset/cut/piece_files.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/uio.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <filesystem>
#include <fstream>
#include <memory>
#include <nlohmann/json.hpp>
#include <set>
#include <system_error>

#include "nephele/levelset/cut/detail/piece_folder.h"
#include "nephele/levelset/cut/detail/piece_measures.h"
#include "nephele/levelset/io/memory_file.h"
#include "nephele/levelset/io/mesh_io.h"
#include "nephele/levelset/io/obj_text.h"
#include "nephele/levelset/io/vdb_io.h"
#include "nephele/levelset/mesh/mesh_band.h"
#include "nephele/levelset/mesh/mesh_repair.h"
#include "nephele/modeling/base/error.h"
#include "nephele/modeling/base/parallel.h"

namespace nephele {
namespace {

namespace fs = std::filesystem;
using detail::ObjCoordinates;
using detail::PieceFolder;
using detail::TextWriter;
using nlohmann::json;

constexpr const char* kMaterials = "pieces.mtl";
constexpr const char* kAll = "pieces.obj";
constexpr const char* kExploded = "exploded.obj";
constexpr const char* kLevelSets = "pieces.vdb";

constexpr const char* kMaterialText =
    "newmtl outside\nKd 0.62 0.63 0.65\nNs 10\nillum 1\n\nnewmtl inside\nKd 0.86 0.52 0.3\nNs 10\nillum 1\n";

/// A file that is written in one go: the texts together, in as few calls as the system allows.
void writeText(const std::string& temporary, const std::string& name,
               std::span<const std::string_view> texts) {
  const auto failed = [&] {
    return Error(fmt::format("cannot write {}: {}", name, std::generic_category().message(errno)));
  };
  const int file = ::open(temporary.c_str(), O_CREAT | O_WRONLY | O_CLOEXEC, 0666);
  if (file < 0) throw failed();
  std::vector<iovec> parts;
  for (const std::string_view text : texts)
    if (!text.empty()) parts.push_back({const_cast<char*>(text.data()), text.size()});
  constexpr std::size_t kMostParts = 1024;
  for (std::size_t first = 0; first < parts.size();) {
    const ssize_t written =
        ::writev(file, parts.data() + first, int(std::min(kMostParts, parts.size() - first)));
    if (written < 0 && errno == EINTR) continue;
    if (written < 0) {
      const Error error = failed();
      ::close(file);
      throw error;
    }
    auto left = std::size_t(written);
    for (; first < parts.size() && left >= parts[first].iov_len; ++first) left -= parts[first].iov_len;
    if (left > 0) {
      parts[first].iov_base = static_cast<char*>(parts[first].iov_base) + left;
      parts[first].iov_len -= left;
    }
  }
  if (::close(file) != 0) throw failed();
}

/// The lines of a piece.
struct PieceText {
  std::string points, faces;
  ObjCoordinates uv;
};

/// Groups with a material each.
Mesh withMaterials(const Mesh& mesh) {
  Mesh result = mesh;
  for (MeshGroup& group : result.groups)
    if (group.name == detail::kInsideGroup)
      group.material = detail::kInsideGroup;
    else if (group.material.empty())
      group.material = "outside";
  return result;
}

/// Statements that name the files of materials.
std::string libraries(const Pieces& pieces, const std::string& folder) {
  std::set<std::string> files;
  for (const Piece& piece : pieces.pieces)
    for (const std::string& file : piece.mesh.materialFiles)
      if (fs::path(file).filename() != kMaterials) files.insert(file);
  TextWriter text;
  text.text(fmt::format("mtllib {}\n", kMaterials));
  detail::writeObjLibraries(text, {files.begin(), files.end()}, folder);
  return text.take();
}

class PieceWriter {
 public:
  PieceWriter(const Pieces& pieces, const PieceFilesOptions& options)
      : pieces_(pieces), options_(options), folder_(options.folder) {
    const char* extension = options.format == PieceFilesOptions::Format::obj ? ".obj" : ".ply";
    for (const Piece& piece : pieces.pieces) names_.push_back(piece.name + extension);
    for (const char* name : {kMaterials, kAll}) names_.push_back(name);
    if (options.explode) names_.push_back(kExploded);
    if (options.levelSetVoxelSize) names_.push_back(kLevelSets);
    names_.push_back(PieceFolder::kList);
    folder_.expect(names_);
    libraries_ = libraries(pieces, options.folder);
  }

  std::vector<std::string> write(const Progress& progress) {
    std::vector<PieceText> texts(pieces_.pieces.size());
    writePieces(texts, progress);
    std::size_t next = pieces_.pieces.size();
    writeText(folder_.temporary(next), names_[next], std::vector<std::string_view>{kMaterialText});
    writeAll(++next, texts);
    if (options_.explode) writeExploded(++next, texts, progress);
    texts.clear();
    progress.check();
    if (options_.levelSetVoxelSize) writeLevelSets(++next, progress);
    writeList(++next);
    progress.check();
    folder_.commit();
    return names_;
  }

 private:
  void writePieces(std::vector<PieceText>& texts, const Progress& progress) {
    std::vector<std::uint64_t> points(1, 0);
    for (const Piece& piece : pieces_.pieces) points.push_back(points.back() + piece.mesh.positions.size());
    parallelFor(
        pieces_.pieces.size(), 4,
        [&](std::size_t begin, std::size_t end) {
          for (std::size_t i = begin; i < end; ++i) {
            const Mesh mesh = withMaterials(pieces_.pieces[i].mesh);
            TextWriter pointText;
            // Beside pieces that are .ply files stands the .obj of all.
            const bool isPly = options_.format == PieceFilesOptions::Format::ply;
            namingFile(isPly ? kAll : names_[i],
                       [&] { texts[i].uv = detail::writeObjPoints(pointText, mesh); });
            texts[i].points = pointText.take();
            const std::string temporary = folder_.temporary(i);
            if (isPly) {
              writeMesh(temporary, mesh);
              continue;
            }
            TextWriter faces;
            detail::writeObjFaces(faces, mesh, texts[i].uv);
            const std::string head = fmt::format("{}o {}\n", libraries_, pieces_.pieces[i].name);
            writeText(temporary, names_[i],
                      std::vector<std::string_view>{head, texts[i].points, faces.kept()});
          }
        },
        progress);
    // Faces of the file of all need to know what comes before them.
    std::vector<std::uint64_t> coordinates(1, 0);
    for (const PieceText& text : texts) coordinates.push_back(coordinates.back() + text.uv.count);
    parallelFor(
        pieces_.pieces.size(), 4,
        [&](std::size_t begin, std::size_t end) {
          for (std::size_t i = begin; i < end; ++i) {
            TextWriter faces;
            detail::writeObjFaces(faces, withMaterials(pieces_.pieces[i].mesh), texts[i].uv, false, points[i],
                                  coordinates[i]);
            texts[i].faces = faces.take();
          }
        },
        progress);
  }

  /// All pieces in one file, an object and a group each.
  void writeAll(std::size_t index, const std::vector<PieceText>& texts) {
    std::vector<std::string> heads;
    for (const Piece& piece : pieces_.pieces) heads.push_back(fmt::format("o {0}\ng {0}\n", piece.name));
    std::vector<std::string_view> parts{libraries_};
    for (std::size_t i = 0; i < texts.size(); ++i)
      parts.insert(parts.end(), {heads[i], texts[i].points, texts[i].faces});
    writeText(folder_.temporary(index), names_[index], parts);
  }

  /// Moved points, the same faces. (Texture coordinates stand among the points.)
  void writeExploded(std::size_t index, std::vector<PieceText>& texts, const Progress& progress) {
    const std::vector<Vec3d> offsets = explodedOffsets(pieces_, *options_.explode);
    parallelFor(
        texts.size(), 4,
        [&](std::size_t begin, std::size_t end) {
          for (std::size_t i = begin; i < end; ++i) {
            TextWriter points;
            detail::writeObjPoints(points, pieces_.pieces[i].mesh, offsets[i]);
            texts[i].points = points.take();
          }
        },
        progress);
    writeAll(index, texts);
  }

  void writeLevelSets(std::size_t index, const Progress& progress) {
    const double voxelSize = *options_.levelSetVoxelSize;
    std::vector<std::optional<VdbGrid>> grids(pieces_.pieces.size());
    parallelFor(
        grids.size(), 1,
        [&](std::size_t begin, std::size_t end) {
          for (std::size_t i = begin; i < end; ++i) {
            const Piece& piece = pieces_.pieces[i];
            const VdbGridLabel label{piece.name, VdbGridInfo::Class::levelSet};
            grids[i] = piece.level ? toVdb(*piece.level->toBricks(), label)
                                   : toVdb(levelOf(piece.mesh, voxelSize), label);
          }
        },
        progress);
    std::vector<VdbGrid> all;
    for (auto& grid : grids) all.push_back(std::move(*grid));
    writeVdbFile(folder_.temporary(index), all, options_.metadata);
  }

  static VoxelGrid<float> levelOf(const Mesh& polygons, double voxelSize) {
    const Mesh mesh = triangulated(polygons);
    const detail::BandOptions options{.voxelSize = voxelSize};
    auto band = detail::signedBand(detail::surfaceGeometry(mesh), options, silent());
    return band ? *std::move(band) : detail::floodedBand(mesh, options, silent());
  }

  void writeList(std::size_t index) {
    json head = json::object();
    for (const auto& [key, value] : options_.metadata) head[key] = value;
    head["creator"] = "nephele";
    head["source"] = options_.source;
    head["geometry"] = options_.geometry;
    head["kerf"] = options_.kerf;
    head["knives"] = options_.knives;
    head["cells"] = json::array();
    for (const Vec3f& p : options_.cells) head["cells"].push_back({p.x, p.y, p.z});
    head["files"] = names_;
    head["volume_original"] = pieces_.volumeOriginal;
    head["volume_sum"] = pieces_.volumeSum;
    head["slivers"] = {{"count", pieces_.slivers}, {"volume", pieces_.sliverVolume}};
    // A line for each piece.
    constexpr auto kReplace = json::error_handler_t::replace;
    std::string text = "{\n";
    for (const auto& [key, value] : head.items())
      text += fmt::format("  {}: {},\n", json(key).dump(), value.dump(-1, ' ', false, kReplace));
    text += "  \"pieces\": [\n";
    for (std::size_t i = 0; i < pieces_.pieces.size(); ++i)
      text += fmt::format("    {}{}\n", describe(i).dump(-1, ' ', false, kReplace),
                          i + 1 < pieces_.pieces.size() ? "," : "");
    text += "  ]\n}\n";
    writeText(folder_.temporary(index), names_[index], std::vector<std::string_view>{text});
  }

  json describe(std::size_t i) const {
    const Piece& piece = pieces_.pieces[i];
    const auto vector = [](const Vec3d& v) { return json{v.x, v.y, v.z}; };
    json neighbours = json::array();
    for (const PieceContact& contact : piece.neighbours)
      neighbours.push_back({{"name", pieces_.pieces[contact.piece].name}, {"area", contact.area}});
    const auto& m = piece.mass.inertia;
    json result = {{"name", piece.name},
                   {"file", names_[i]},
                   {"parent", piece.parent.empty() ? json() : json(piece.parent)},
                   {"code", codeText(piece.code)},
                   {"volume", piece.mass.volume},
                   {"area", piece.mass.area},
                   {"centroid", vector(piece.mass.centroid)},
                   {"inertia", {{m[0], m[1], m[2]}, {m[3], m[4], m[5]}, {m[6], m[7], m[8]}}},
                   {"box", {{"min", vector(piece.boxMin)}, {"max", vector(piece.boxMax)}}},
                   {"neighbours", neighbours}};
    if (piece.cell) result["cell"] = *piece.cell;
    return result;
  }

  const Pieces& pieces_;
  const PieceFilesOptions& options_;
  PieceFolder folder_;
  std::vector<std::string> names_;
  std::string libraries_;
};

CutPart readPart(const fs::path& file, std::string name, std::string parent) {
  return {std::move(name), std::move(parent), readMesh(file.string()), nullptr};
}

}  // namespace

std::string codeText(const PieceCode& code) {
  std::string text;
  for (const bool side : code.sides) text += side ? '+' : '-';
  return text;
}

bool isPieceName(const std::string& name) {
  constexpr std::string_view kStem = "piece";
  if (!name.starts_with(kStem) || name.size() == kStem.size()) return false;
  for (std::size_t i = kStem.size(); i < name.size();) {
    if (name[i++] != '_') return false;
    const std::size_t end = std::min(name.find_first_not_of("0123456789", i), name.size());
    if (end < i + 4) return false;
    i = end;
  }
  return true;
}

std::vector<Vec3d> explodedOffsets(const Pieces& pieces, double explode) {
  Vec3d centre{};
  for (const Piece& piece : pieces.pieces)
    centre += piece.mass.centroid * (piece.mass.volume / pieces.volumeSum);
  std::vector<Vec3d> offsets;
  for (const Piece& piece : pieces.pieces) offsets.push_back((piece.mass.centroid - centre) * explode);
  return offsets;
}

std::vector<std::string> writePieces(const Pieces& pieces, const PieceFilesOptions& options,
                                     const Progress& progress) {
  require(!pieces.pieces.empty(), "there are no pieces to write");
  if (MemoryFile::put(options.folder, [&] { return std::make_shared<const Pieces>(pieces); })) return {};
  return PieceWriter(pieces, options).write(progress);
}

void requireWritableFolder(const std::string& folder) {
  if (MemoryFile::find(folder)) return;
  PieceFolder trial(folder);
  trial.expect({PieceFolder::kList});
  trial.temporary(0);
}

std::vector<CutPart> readPieces(const std::string& folder, const Progress& progress) {
  struct Entry {
    fs::path file;
    std::string name, parent;
  };
  std::vector<Entry> entries;
  std::error_code error;
  require(fs::is_directory(folder, error), fmt::format("{}: is no folder", folder));
  const fs::path list = fs::path(folder) / PieceFolder::kList;
  if (fs::exists(list, error)) {
    std::ifstream stream(list);
    const json found = json::parse(stream, nullptr, false);
    require(found.is_object() && found.contains("pieces") && found["pieces"].is_array(),
            fmt::format("{}: is no list of pieces", list.string()));
    for (const json& piece : found["pieces"]) {
      require(piece.is_object() && piece.contains("name") && piece["name"].is_string() &&
                  piece.contains("file") && piece["file"].is_string(),
              fmt::format("{}: a piece has no name or no file", list.string()));
      const json parent = piece.value("parent", json());
      entries.push_back({fs::path(folder) / piece["file"].get<std::string>(), piece["name"],
                         parent.is_string() ? parent.get<std::string>() : ""});
    }
  } else {
    static const std::set<std::string> kMeshes{".obj", ".ply", ".stl", ".off", ".gltf", ".glb"};
    for (const auto& entry : fs::directory_iterator(folder))
      if (kMeshes.count(entry.path().extension().string()) > 0 &&
          !entry.path().filename().string().starts_with('.'))
        entries.push_back({entry.path(), entry.path().stem().string(), ""});
    std::sort(entries.begin(), entries.end(), [](const Entry& a, const Entry& b) { return a.file < b.file; });
  }
  require(!entries.empty(), fmt::format("{}: holds no pieces", folder));
  std::vector<CutPart> parts(entries.size());
  parallelFor(
      entries.size(), 1,
      [&](std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end; ++i)
          parts[i] = readPart(entries[i].file, entries[i].name, entries[i].parent);
      },
      progress);
  return parts;
}

}  // namespace nephele
