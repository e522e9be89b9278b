#pragma once

#include <OpenColorIO/OpenColorIO.h>

#include <string>

// OpenColorIO follows whatever a configuration says, without an end if it goes round in circles.
namespace nephele::detail {

/// @throws Error, without the path, if `text` repeats parts of itself (`*name`) so often that a few lines
/// could stand for millions.
void checkConfigText(const std::string& text);

/// What OpenColorIO would do for `transform`. @throws Error, without the path, if something that it needs is
/// defined by itself, if it has more than 10000 steps or 100 within each other, or if a table is no file, has
/// more than 256 MB, or refers to other files.
void checkTransform(const OCIO_NAMESPACE::ConstConfigRcPtr& config,
                    const OCIO_NAMESPACE::ConstTransformRcPtr& transform);

/// The same of the variables that `config` gives values to.
void checkVariables(const OCIO_NAMESPACE::ConstConfigRcPtr& config);

}  // namespace nephele::detail
