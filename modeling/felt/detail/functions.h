#pragma once

#include "nephele/modeling/felt/argument.h"
#include "nephele/modeling/felt/registry.h"

/// The built-in functions of modeling, by the headings of the reference.
namespace nephele::felt {

/// a - b. @throws CallError if that is no integer of 64 bits.
std::int64_t difference(std::int64_t a, std::int64_t b);
/// a to the power b. @throws CallError if that is no number, or would divide by zero.
double power(double a, double b);

void addArithmetic(Registry& registry);
void addFieldArithmetic(Registry& registry);
void addNumberFunctions(Registry& registry);
void addValueFunctions(Registry& registry);
void addFieldFunctions(Registry& registry);
void addNoiseFunctions(Registry& registry);
void addShapeFunctions(Registry& registry);
void addCloudFunctions(Registry& registry);

}  // namespace nephele::felt
