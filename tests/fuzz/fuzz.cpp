// One program for all formats: `nephele_fuzz --format=obj [libFuzzer's options] [corpus]`. Of files to begin
// from, which must be readable, it writes changes that are the same every time,
// `--format=obj --write-inputs=FOLDER --seeds=FOLDER --count=300`.
#include <fmt/format.h>
#include <tbb/global_control.h>

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <memory>

#include "nephele/modeling/base/system.h"
#include "tests/fuzz/fixed_inputs.h"
#include "tests/fuzz/formats.h"
#include "tests/fuzz/harness.h"
#include "tests/fuzz/json_changes.h"
#include "tests/fuzz/mutators.h"
#include "tests/fuzz/verb_calls.h"

namespace nephele::fuzz {
namespace {

constexpr Format kFormats[] = {
    {"obj", ".obj", useMesh},
    {"ply", ".ply", useMesh},
    {"stl", ".stl", useMesh},
    {"off", ".off", useMesh},
    {"gltf", ".gltf", useMesh, mutateJson},
    {"glb", ".glb", useMesh, mutateGlb},
    {"vdb", ".vdb", useVolume, mutateBlocks},
    {"nvdb", ".nvdb", useVolume, mutateNanoVdb},
    {"exr", ".exr", usePicture, mutateBlocks},
    {"deep", ".exr", useDeepPicture, mutateBlocks},
    {"hdr", ".hdr", usePicture},
    {"png", ".png", usePicture, mutatePng},
    {"chan", ".chan", useCamera},
    {"camera", ".json", useCamera, mutateJson},
    {"ocio", ".ocio", useViewConfig},
    {"toml", ".toml", useToml},
    {"field", ".txt", useFieldTexts},
    {"felt", ".felt", useScript},
    {"verbs", ".txt", useVerb, mutateArguments},
    {"calls", ".bin", useCalls},
};

const Format* chosen = nullptr;

const Format* formatCalled(std::string_view name) {
  for (const Format& format : kFormats)
    if (format.name == name) return &format;
  return nullptr;
}

struct InputsUsed {
  std::uint64_t read = 0, all = 0;
  /// In the words of libFuzzer's own statistics.
  ~InputsUsed() {
    if (all > 0)
      std::fprintf(stderr, "stat::inputs_that_were_read:   %llu\n", static_cast<unsigned long long>(read));
  }
} inputsUsed;

/// Some inputs that could be read. libFuzzer's corpus fills with files that are broken in ever other ways,
/// and changes of these seldom get behind the reader. In memory that is there from the start: libFuzzer looks
/// for leaks after each input that leaves something allocated.
class ReadableInputs {
 public:
  void remember(std::string_view bytes) {
    if (bytes.size() > kLongest) return;
    Input& input = inputs_[seen_++ % kMost];
    std::copy(bytes.begin(), bytes.end(), input.bytes);
    input.size = bytes.size();
  }
  std::string_view any(std::size_t number) const {
    const Input& input = inputs_[number % std::min(seen_, kMost)];
    return {input.bytes, input.size};
  }
  bool isEmpty() const { return seen_ == 0; }

 private:
  static constexpr std::size_t kMost = 64, kLongest = 1 << 16;
  struct Input {
    char bytes[kLongest];
    std::size_t size;
  };
  Input inputs_[kMost]{};
  std::size_t seen_ = 0;
};

ReadableInputs readable;

std::uint64_t hashOf(std::string_view bytes) {
  std::uint64_t hash = 14695981039346656037u;
  for (const char c : bytes) hash = (hash ^ std::uint8_t(c)) * 1099511628211u;
  return hash ^ (hash >> 29);
}

bool use(std::string_view bytes) {
  const Input input{scratchPath(fmt::format("input{}", chosen->extension)), bytes, hashOf(bytes)};
  std::ofstream(input.path, std::ios::binary | std::ios::trunc) << bytes;
  setInput(bytes);
  return chosen->use(input);
}

/// Changes of a file that cannot be read say nothing of its reader.
void requireReadable(const std::string& seeds) {
  for (const auto& entry : std::filesystem::directory_iterator(seeds)) {
    std::ifstream file(entry.path(), std::ios::binary);
    const std::string bytes{std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
    expect(use(bytes), fmt::format("{} cannot be read: {}", entry.path().string(), lastError()));
  }
}

}  // namespace

std::span<const Format> formats() {
  return kFormats;
}

}  // namespace nephele::fuzz

extern "C" int LLVMFuzzerInitialize(int* argc, char*** argv) {
  using namespace nephele::fuzz;
  nephele::returnLargeBlocksAtOnce();
  // One thread: what is reached depends on the input alone.
  static const tbb::global_control oneThread(tbb::global_control::max_allowed_parallelism, 1);
  int kept = 1, count = 0;
  std::string seeds, inputs;
  for (int i = 1; i < *argc; ++i) {
    const std::string_view argument = (*argv)[i];
    if (argument.starts_with("--format=")) {
      chosen = formatCalled(argument.substr(9));
    } else if (argument.starts_with("--write-inputs=")) {
      inputs = argument.substr(15);
    } else if (argument.starts_with("--seeds=")) {
      seeds = argument.substr(8);
    } else if (argument.starts_with("--count=")) {
      count = std::stoi(std::string(argument.substr(8)));
    } else {
      (*argv)[kept++] = (*argv)[i];
    }
  }
  if (!chosen) {
    std::string names;
    for (const Format& format : kFormats) names += fmt::format("{}{}", names.empty() ? "" : "|", format.name);
    std::fprintf(stderr, "nephele_fuzz: --format=%s\n", names.c_str());
    std::exit(2);
  }
  if (!inputs.empty()) {
    requireReadable(seeds);
    writeFixedInputs(*chosen, seeds, inputs, count);
    std::exit(0);
  }
  *argc = kept;
  return 0;
}

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace nephele::fuzz;
  ++inputsUsed.all;
  const std::string_view bytes(reinterpret_cast<const char*>(data), size);
  if (use(bytes)) {
    ++inputsUsed.read;
    readable.remember(bytes);
  }
  return 0;
}

extern "C" std::size_t LLVMFuzzerMutate(std::uint8_t* data, std::size_t size, std::size_t most);

extern "C" std::size_t LLVMFuzzerCustomMutator(std::uint8_t* data, std::size_t size, std::size_t most,
                                               unsigned seed) {
  using namespace nephele::fuzz;
  const auto change = [](Bytes bytes, std::size_t used) {
    return LLVMFuzzerMutate(bytes.data(), used, bytes.size());
  };
  if (const std::uint32_t dice = seed >> 16; dice % 2 == 0 && !readable.isEmpty()) {
    const std::string_view other = readable.any(dice / 2);
    size = std::min(other.size(), most);
    std::copy_n(other.begin(), size, data);
  }
  if (chosen->mutator && seed % 4 != 0) return chosen->mutator({data, most}, size, seed, change);
  return change({data, most}, size);
}
