#pragma once

/// Operations on lanes: what scalar operations of fields compute, once as a plain function (the truth) and
/// once for whole lanes. Lane arguments are 64-byte aligned, `count` is a multiple of 16, and outputs may be
/// inputs.
namespace nephele::detail {

enum class Unary {
  negate,
  absolute,
  square,
  squareRoot,
  exponential,
  logarithm,
  sine,
  cosine,
  tangent,
  arcSine,
  arcCosine,
  arcTangent,
  floor,
  mask,        // x > 0
  clamp,       // between p and q
  smoothstep,  // from p to q
};

enum class Binary {
  add,
  subtract,
  multiply,
  divide,
  minimum,
  maximum,
  power,
  arcTangent2,
  blend /* radius p */
};

/// Constants of an operation.
struct Parameters {
  float p = 0, q = 0;
};

/// The truth for one value. Lane results equal it bit for bit, except sine and cosine (3 ulp, or 1e-7 where
/// that is more), exponential (2 ulp) and logarithm (4 ulp).
float scalarValue(Unary op, Parameters parameters, float a);
float scalarValue(Binary op, Parameters parameters, float a, float b);

/// a op b of numbers or intervals, for the four operations of arithmetic.
template <class Number>
Number arithmetic(Binary op, const Number& a, const Number& b) {
  if (op == Binary::add) return a + b;
  if (op == Binary::subtract) return a - b;
  return op == Binary::multiply ? a * b : a / b;
}

/// out = op(a).
void apply(Unary op, Parameters parameters, const float* a, float* out, int count);
/// out = op(a), and the chain rule in place: g[k] = op'(a) g[k].
void applyGrad(Unary op, Parameters parameters, const float* a, float* out, float* const g[3], int count);
/// out = op(a, b).
void apply(Binary op, Parameters parameters, const float* a, const float* b, float* out, int count);
/// out = op(a, b), and the chain rule in place: ga[k] = d op/da ga[k] + d op/db gb[k].
void applyGrad(Binary op, Parameters parameters, const float* a, const float* b, float* out,
               float* const ga[3], const float* const gb[3], int count);

/// out = sign a b, or out += sign a b: first the product is rounded, then the sum.
void product(const float* a, const float* b, float sign, bool accumulate, float* out, int count);
/// out = sqrt(x^2 + y^2 + z^2).
void length3(const float* const v[3], float* out, int count);
/// out = (1 / length) v, or 0 where length is 0.
void normalize3(const float* const v[3], const float* length, float* const out[3], int count);
/// out[r] = m[3 r] x + m[3 r + 1] y + m[3 r + 2] z + t[r], a map of points.
void affine3(const float m[9], const float t[3], const float* const v[3], float* const out[3], int count);

}  // namespace nephele::detail
