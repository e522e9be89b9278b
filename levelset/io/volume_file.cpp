#include "nephele/levelset/io/detail/file_extension.h"
#include "nephele/levelset/io/vdb_io.h"

namespace nephele {

bool isVolumeFile(const std::string& path) {
  const std::string extension = detail::lowerExtension(path);
  return extension == ".vdb" || extension == ".nvdb";
}

}  // namespace nephele
