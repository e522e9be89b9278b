#pragma once

#include "nephele/modeling/felt/argument.h"
#include "nephele/modeling/felt/registry.h"

/// The built-in functions of modeling, by the headings of the reference.
namespace nephele::felt {

void addArithmetic(Registry& registry);
void addFieldArithmetic(Registry& registry);
void addNumberFunctions(Registry& registry);
void addValueFunctions(Registry& registry);
void addFieldFunctions(Registry& registry);
void addNoiseFunctions(Registry& registry);
void addShapeFunctions(Registry& registry);
void addCloudFunctions(Registry& registry);

}  // namespace nephele::felt
