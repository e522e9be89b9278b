#pragma once

#include "nephele/levelset/grid/brick_grid.h"
#include "nephele/modeling/felt/context.h"
#include "nephele/modeling/felt/value.h"

/// Fields sampled on the domains of scripts. Samples stand at the corners of cells: at
/// origin + R (i a, j b, k c) with cells of a, b, c and i, j, k from 0 to the number of cells.
namespace nephele::felt {

/// From the numbers i, j, k of samples to the world.
Affine sampleToWorld(const Domain& domain);

/// `field` sampled on `domain` and interpolated: trilinear inside, outside the value of the nearest point of
/// the box, so that what flows in at a border is what is there.
///
/// Gradients are differences of fourth order over two and four cells, also at the border, for which two
/// layers of samples beyond it are taken; outside they are 0 along the edges of the box that were left. They
/// cost several times what values do. Where one sample alone is not finite, as the direction of a distance at
/// its centre, it becomes the mean of the six around it. Where the field is one number over many cells, it
/// costs neither time nor memory. All cores; the same bits at any thread count.
/// @throws CallError if the samples may take more memory than `context` allows, or are not finite; Cancelled.
template <class T>
Field<T> sampled(const Field<T>& field, const Domain& domain, const Context& context);

/// Bytes that one function may sample or make.
double allowedBytes(const Context& context);
/// Refuses what needs more memory than `context` allows. `what` and `hint` go into the message.
/// @throws CallError
void requireBytes(double needed, const std::string& what, const std::string& hint, const Context& context);
/// The same for so many components of samples on a domain. @throws also Error as `requireValid`
void requireRoom(const Domain& domain, int components, const Context& context);
/// Bytes that `sampled` needs at most, for so many components.
double sampledBytes(const Domain& domain, int components);

extern template Field<float> sampled(const Field<float>&, const Domain&, const Context&);
extern template Field<Vec3f> sampled(const Field<Vec3f>&, const Domain&, const Context&);
extern template Field<Mat3f> sampled(const Field<Mat3f>&, const Domain&, const Context&);

}  // namespace nephele::felt
