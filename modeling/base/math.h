#pragma once

#include <array>
#include <cmath>
#include <compare>

namespace nephele {

/// Three coordinates. Plain data; arithmetic is component-wise.
template <class T>
struct Vec3 {
  T x{}, y{}, z{};

  constexpr Vec3() = default;
  constexpr Vec3(T x_, T y_, T z_) : x(x_), y(y_), z(z_) {}
  template <class U>
  constexpr explicit Vec3(const Vec3<U>& v) : x(T(v.x)), y(T(v.y)), z(T(v.z)) {}

  constexpr T& operator[](int i) { return i == 0 ? x : i == 1 ? y : z; }
  constexpr const T& operator[](int i) const { return i == 0 ? x : i == 1 ? y : z; }
  constexpr auto operator<=>(const Vec3&) const = default;

  constexpr Vec3& operator+=(const Vec3& b) { return *this = *this + b; }
  constexpr Vec3& operator-=(const Vec3& b) { return *this = *this - b; }
  constexpr Vec3& operator*=(T s) { return *this = *this * s; }

  friend constexpr Vec3 operator+(const Vec3& a, const Vec3& b) { return {a.x + b.x, a.y + b.y, a.z + b.z}; }
  friend constexpr Vec3 operator-(const Vec3& a, const Vec3& b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
  friend constexpr Vec3 operator-(const Vec3& a) { return {-a.x, -a.y, -a.z}; }
  friend constexpr Vec3 operator*(const Vec3& a, T s) { return {a.x * s, a.y * s, a.z * s}; }
  friend constexpr Vec3 operator*(T s, const Vec3& a) { return a * s; }
  friend constexpr Vec3 operator*(const Vec3& a, const Vec3& b) { return {a.x * b.x, a.y * b.y, a.z * b.z}; }
  friend constexpr Vec3 operator/(const Vec3& a, T s) { return {a.x / s, a.y / s, a.z / s}; }
};

using Vec3f = Vec3<float>;
using Vec3d = Vec3<double>;
using Vec3i = Vec3<int>;

template <class T>
constexpr T dot(const Vec3<T>& a, const Vec3<T>& b) {
  return a.x * b.x + a.y * b.y + a.z * b.z;
}

template <class T>
constexpr Vec3<T> cross(const Vec3<T>& a, const Vec3<T>& b) {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}

template <class T>
T length(const Vec3<T>& a) {
  return std::sqrt(dot(a, a));
}

/// `a` scaled to length 1; a zero vector stays zero.
template <class T>
Vec3<T> normalize(const Vec3<T>& a) {
  const T l = length(a);
  return l > T(0) ? a / l : Vec3<T>{};
}

template <class T>
constexpr Vec3<T> min(const Vec3<T>& a, const Vec3<T>& b) {
  return {a.x < b.x ? a.x : b.x, a.y < b.y ? a.y : b.y, a.z < b.z ? a.z : b.z};
}

template <class T>
constexpr Vec3<T> max(const Vec3<T>& a, const Vec3<T>& b) {
  return {a.x > b.x ? a.x : b.x, a.y > b.y ? a.y : b.y, a.z > b.z ? a.z : b.z};
}

template <class T>
bool isFinite(const Vec3<T>& a) {
  return std::isfinite(a.x) && std::isfinite(a.y) && std::isfinite(a.z);
}

/// A 3x3 matrix, row-major: m[row * 3 + column].
struct Mat3f {
  std::array<float, 9> m{};

  static constexpr Mat3f identity() { return {{1, 0, 0, 0, 1, 0, 0, 0, 1}}; }
  static constexpr Mat3f scaling(float s) { return {{s, 0, 0, 0, s, 0, 0, 0, s}}; }
  /// Right-handed turn by `radians` about `axis`, which need not have length 1 but must not be zero.
  static Mat3f rotation(const Vec3f& axis, float radians);

  constexpr float operator()(int row, int column) const { return m[row * 3 + column]; }
  constexpr float& operator()(int row, int column) { return m[row * 3 + column]; }
  constexpr bool operator==(const Mat3f&) const = default;
};

Mat3f operator*(const Mat3f& a, const Mat3f& b);
Vec3f operator*(const Mat3f& a, const Vec3f& v);
Mat3f transpose(const Mat3f& a);
float determinant(const Mat3f& a);
/// @throws Error if the determinant is 0 or not finite.
Mat3f inverse(const Mat3f& a);

/// x -> linear * x + translation.
struct Affine {
  Mat3f linear = Mat3f::identity();
  Vec3f translation{};

  Vec3f operator()(const Vec3f& p) const { return linear * p + translation; }
};

/// The map that undoes `a`. @throws Error if `a.linear` is singular.
Affine inverse(const Affine& a);

inline constexpr float kPi = 3.14159265358979323846f;
constexpr float radians(float degrees) {
  return degrees * (kPi / 180.0f);
}
constexpr float degrees(float radians) {
  return radians * (180.0f / kPi);
}

}  // namespace nephele
