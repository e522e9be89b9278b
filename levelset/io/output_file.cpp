// Outputs that appear whole or not at all.
//
// The temporary is created with O_EXCL (so two processes never share one) and the usual permissions, in the
// folder of the target, so that rename() is atomic. The temporaries that are open sit in a list whose nodes
// are never freed and are claimed atomically: the signal handler and the destructor never use a path at
// once, and the handler needs no lock and no memory.
#include "nephele/levelset/io/output_file.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <system_error>
#include <utility>

#include "nephele/levelset/io/memory_file.h"
#include "nephele/modeling/base/error.h"
#include "nephele/modeling/base/parallel.h"
#include "nephele/modeling/base/text_file.h"

namespace nephele {
namespace {

namespace fs = std::filesystem;

enum class State { free, open, busy, discarded };

// Nodes are reused but never freed. While a node is open, whoever makes it busy may use its path.
struct OpenTemporary {
  std::atomic<State> state{State::free};
  std::string path;
  OpenTemporary* next = nullptr;
};

std::atomic<OpenTemporary*> openTemporaries{nullptr};

static_assert(std::atomic<State>::is_always_lock_free && std::atomic<OpenTemporary*>::is_always_lock_free);

OpenTemporary* enlist(const std::string& path) {
  OpenTemporary* node = openTemporaries.load();
  for (State expected = State::free; node; node = node->next, expected = State::free)
    if (node->state.compare_exchange_strong(expected, State::busy)) break;
  const bool isNew = node == nullptr;
  if (isNew) {
    node = new OpenTemporary;
    node->state = State::busy;
  }
  node->path = path;
  node->state = State::open;
  if (isNew) {
    node->next = openTemporaries.load();
    while (!openTemporaries.compare_exchange_weak(node->next, node)) {
    }
  }
  return node;
}

void strike(void* entry) {
  auto* node = static_cast<OpenTemporary*>(entry);
  State expected = State::open;
  while (!node->state.compare_exchange_weak(expected, State::busy) && expected != State::discarded)
    expected = State::open;  // another thread is discarding it at this moment
  node->state = State::free;
}

std::string reason(int error) {
  return std::generic_category().message(error);
}

void copyInto(const std::string& stream, const std::string& from) {
  std::ifstream in(from, std::ios::binary);
  std::ofstream out(stream, std::ios::binary | std::ios::app);
  if (in.peek() != std::ifstream::traits_type::eof()) out << in.rdbuf();
  out.close();
  if (!in || !out) throw Error(fmt::format("cannot write {}: {}", stream, reason(errno)));
}

}  // namespace

std::string outputTarget(const std::string& path) {
  constexpr int kMostLinks = 40;
  fs::path target = path;
  std::error_code error;
  for (int i = 0; i != kMostLinks && fs::is_symlink(target, error); ++i) {
    const fs::path next = fs::read_symlink(target, error);
    if (error) break;
    target = next.is_absolute() ? next : target.parent_path() / next;
  }
  return target.string();
}

bool isStream(const std::string& path) {
  if (MemoryFile::find(path)) return true;
  std::error_code ignored;
  const fs::file_status status = fs::status(path, ignored);
  return fs::exists(status) && !fs::is_regular_file(status) && !fs::is_directory(status);
}

OutputFile::OutputFile(std::string path)
    : path_(std::move(path)), target_(outputTarget(path_)), isStream_(isStream(path_)) {
  require(!path_.empty(), "output: the file name is empty");
  requireWholeName(path_);
  const fs::path target(isStream_ ? path_ : target_);
  const fs::path folder = isStream_                  ? fs::temp_directory_path()
                          : target.has_parent_path() ? target.parent_path()
                                                     : fs::path(".");
  std::error_code ignored;
  require(!fs::is_symlink(target_, ignored) || isStream_,
          fmt::format("cannot write {}: its symbolic links lead round in a circle", path_));
  std::error_code fault;
  const fs::file_type type = fs::status(target, fault).type();
  require(type != fs::file_type::none, fmt::format("cannot write {}: {}", path_, fault.message()));
  require(target.has_filename() && !fs::is_directory(target, ignored),
          fmt::format("cannot write {}: it is a folder", path_));
  require(fs::exists(folder, ignored),
          fmt::format("cannot write {}: the folder {} does not exist", path_, folder.string()));
  require(fs::is_directory(folder, ignored),
          fmt::format("cannot write {}: {} is not a folder", path_, folder.string()));

  // A temporary has a number more than the name, which may be as long as the system allows.
  constexpr std::size_t kMostOfName = 100;
  const std::string extension = target.extension().string();
  static std::atomic<unsigned> serial{0};
  for (int attempt = 0; attempt < 1000; ++attempt) {
    const std::string name = fmt::format(".{}.{}-{}{}", target.stem().string().substr(0, kMostOfName),
                                         ::getpid(), serial++, extension.substr(0, kMostOfName));
    temporary_ = (folder / name).string();
    entry_ = enlist(temporary_);
    const int descriptor = ::open(temporary_.c_str(), O_CREAT | O_EXCL | O_WRONLY | O_CLOEXEC, 0666);
    const int error = errno;
    if (descriptor >= 0) {
      ::close(descriptor);
      return;
    }
    strike(entry_);
    require(error == EEXIST, fmt::format("cannot write {}: {}", path_, reason(error)));
  }
  throw Error(fmt::format("cannot write {}: no free temporary name in {}", path_, folder.string()));
}

OutputFile::~OutputFile() {
  if (committed_) return;
  ::unlink(temporary_.c_str());
  strike(entry_);
}

void OutputFile::commit() {
  require(!committed_, fmt::format("{} is already written", path_));
  if (isStream_) {
    copyInto(path_, temporary_);
    ::unlink(temporary_.c_str());
  } else if (std::rename(temporary_.c_str(), target_.c_str()) != 0) {
    throw Error(fmt::format("cannot write {}: {}", path_, reason(errno)));
  }
  committed_ = true;
  strike(entry_);
}

void OutputFile::withdraw() noexcept {
  if (committed_ && !isStream_) ::unlink(target_.c_str());
}

OutputStream::OutputStream(const OutputFile& output)
    : output_(output), file_(std::fopen(output.temporaryPath().c_str(), "wb")) {
  if (!file_) {
    error_ = errno;
    fail();
  }
  // Writers through C's library leave the reason there.
  errno = 0;
}

OutputStream::~OutputStream() {
  if (file_) std::fclose(file_);
}

void OutputStream::fail() const {
  throw Error(fmt::format("cannot write {}: {}", output_.path(), reason(error_)));
}

void OutputStream::requireWritten() const {
  if (error_ != 0) fail();
}

void OutputStream::write(std::string_view bytes) {
  CancelScope::check();
  requireWritten();
  if (std::fwrite(bytes.data(), 1, bytes.size(), file_) == bytes.size()) return;
  error_ = errno;
  fail();
}

std::uint64_t OutputStream::position() {
  return std::uint64_t(::ftello(file_));
}

void OutputStream::seek(std::uint64_t position) {
  requireWritten();
  if (::fseeko(file_, off_t(position), SEEK_SET) == 0) return;
  error_ = errno;
  fail();
}

void OutputStream::close() {
  CancelScope::check();
  const bool failed = error_ != 0 || std::ferror(file_) != 0 || std::fflush(file_) != 0;
  if (failed && error_ == 0) error_ = errno != 0 ? errno : EIO;
  if (std::fclose(std::exchange(file_, nullptr)) != 0 && error_ == 0) error_ = errno;
  requireWritten();
}

void commitTogether(std::span<OutputFile* const> outputs) {
  for (std::size_t i = 0; i != outputs.size(); ++i) try {
      outputs[i]->commit();
    } catch (const Error&) {
      for (OutputFile* before : outputs.first(i)) before->withdraw();
      throw;
    }
}

void discardAllOutputs() noexcept {
  for (OpenTemporary* node = openTemporaries.load(); node; node = node->next) {
    State expected = State::open;
    if (!node->state.compare_exchange_strong(expected, State::busy)) continue;
    ::unlink(node->path.c_str());
    node->state = State::discarded;
  }
  // Folders, once they are empty; a path that was a file is gone.
  for (OpenTemporary* node = openTemporaries.load(); node; node = node->next)
    if (node->state == State::discarded) ::rmdir(node->path.c_str());
}

detail::OpenOutput::OpenOutput(const std::string& path) : entry_(enlist(path)) {}

detail::OpenOutput::~OpenOutput() {
  strike(entry_);
}

}  // namespace nephele
