#include "apps/options/picture/picture_files.h"

#include "nephele/levelset/io/output_file.h"
#include "nephele/render/image/exr_io.h"
#include "nephele/render/image/png_io.h"

namespace nephele::apps {

void PictureFiles::write(const RenderResult& picture, const ImageCamera& camera, const ViewTransform& screen,
                         const std::map<std::string, std::string>& metadata) const {
  if (!output.empty() && !deep.empty())
    writeExrPair({output, deep}, picture.image, picture.deep.value(), camera, metadata);
  else if (!output.empty())
    writeExr(output, picture.image, camera, metadata);
  else if (!deep.empty())
    writeDeepExr(deep, picture.deep.value(), camera, metadata);
  if (!preview.empty()) writePng(preview, picture.image, screen, metadata);
}

void addPictureFiles(CLI::App& app, PictureFiles& files) {
  addOutput(app, "-o,--output", files.output, {".exr"}, "Picture to write: linear, premultiplied.");
  addOutput(app, "--preview", files.preview, {".png"},
            "The same for the screen, before the sky; may be the only output.");
}

}  // namespace nephele::apps
