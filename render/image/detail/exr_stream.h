#pragma once

#include <OpenEXR/ImfIO.h>

#include <exception>

#include "nephele/levelset/io/output_file.h"
#include "nephele/modeling/base/error.h"

namespace nephele::detail {

/// Where OpenEXR writes to. Its own stream loses what fails while a file is closed, which is when it writes
/// where the lines begin.
class ExrStream : public Imf::OStream {
 public:
  explicit ExrStream(const OutputFile& output) : Imf::OStream(output.path().c_str()), bytes(output) {}

  void write(const char text[], int count) override { bytes.write({text, std::size_t(count)}); }
  std::uint64_t tellp() override { return bytes.position(); }
  void seekp(std::uint64_t position) override { bytes.seek(position); }

  OutputStream bytes;
};

/// Calls `writing` with a stream to `output`. @throws Error naming the path if not all is written.
template <class Writing>
void writeWhole(const OutputFile& output, const Writing& writing) {
  ExrStream stream(output);
  try {
    writing(stream);
  } catch (const std::exception& error) {
    stream.bytes.requireWritten();
    throw Error(output.path() + ": cannot be written: " + error.what());
  }
  stream.bytes.close();
}

}  // namespace nephele::detail
