// Element types of signals and the sizes that signals take.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <type_traits>

namespace bf {

using Vector = Eigen::VectorXd;
using Vector3 = Eigen::Vector3d;
using Vector6 = Eigen::Matrix<double, 6, 1>;
using Matrix = Eigen::MatrixXd;
using Transform = Eigen::Matrix4d; ///< homogeneous transform, column-major

/// Element type of a signal, parameter or state.
enum class Type : std::uint8_t { float64, float32, int8, uint8, int16, uint16, int32, uint32, boolean };
inline constexpr int type_count = 9;

/// The name people write: double, single, int8, ..., uint32, boolean.
const char* name(Type type);
/// The type of that name, or nothing.
std::optional<Type> type_from_name(std::string_view text);
/// Bytes of one element.
int bytes(Type type);

template <class T> inline constexpr bool is_element = false;
template <class T> inline constexpr Type type_of = Type::float64;
template <> inline constexpr bool is_element<double> = true;
template <> inline constexpr bool is_element<float> = true;
template <> inline constexpr bool is_element<std::int8_t> = true;
template <> inline constexpr bool is_element<std::uint8_t> = true;
template <> inline constexpr bool is_element<std::int16_t> = true;
template <> inline constexpr bool is_element<std::uint16_t> = true;
template <> inline constexpr bool is_element<std::int32_t> = true;
template <> inline constexpr bool is_element<std::uint32_t> = true;
template <> inline constexpr bool is_element<bool> = true;
template <> inline constexpr Type type_of<float> = Type::float32;
template <> inline constexpr Type type_of<std::int8_t> = Type::int8;
template <> inline constexpr Type type_of<std::uint8_t> = Type::uint8;
template <> inline constexpr Type type_of<std::int16_t> = Type::int16;
template <> inline constexpr Type type_of<std::uint16_t> = Type::uint16;
template <> inline constexpr Type type_of<std::int32_t> = Type::int32;
template <> inline constexpr Type type_of<std::uint32_t> = Type::uint32;
template <> inline constexpr Type type_of<bool> = Type::boolean;

/// Calls f(std::type_identity<T>{}) with the C++ type of `type`.
template <class F> decltype(auto) with_type(Type type, F&& f) {
    switch (type) {
    case Type::float32: return f(std::type_identity<float>{});
    case Type::int8: return f(std::type_identity<std::int8_t>{});
    case Type::uint8: return f(std::type_identity<std::uint8_t>{});
    case Type::int16: return f(std::type_identity<std::int16_t>{});
    case Type::uint16: return f(std::type_identity<std::uint16_t>{});
    case Type::int32: return f(std::type_identity<std::int32_t>{});
    case Type::uint32: return f(std::type_identity<std::uint32_t>{});
    case Type::boolean: return f(std::type_identity<bool>{});
    case Type::float64: break;
    }
    return f(std::type_identity<double>{});
}

/// Size of a signal. A 1-D signal of n elements is not an n x 1 matrix, although both lie in memory alike.
struct Size {
    int rows = 1, cols = 1;
    bool is_matrix = false;

    int count() const { return rows * cols; }
    bool is_scalar() const { return rows == 1 && cols == 1; }
    bool operator==(const Size&) const = default;
    /// "[3]" for a 1-D signal, "3x4" for a matrix, "scalar" for one element.
    std::string text() const;
};

/// A signal of one fixed element type and any shape, for keys: Output<Array<bool>>.
template <class Element> struct Array {};

/// A key whose element type is decided by wiring. All keys of a block with the same symbol share one type.
template <int symbol_> struct AnyOf { static constexpr int symbol = symbol_; };
using Any = AnyOf<0>;
using Other = AnyOf<1>;

template <class T> inline constexpr int type_symbol = -1; ///< -1: the element type is fixed
template <int symbol> inline constexpr int type_symbol<AnyOf<symbol>> = symbol;

template <class T> struct ElementOf { using type = T; };
template <class E, int R, int C, int O, int MR, int MC> struct ElementOf<Eigen::Matrix<E, R, C, O, MR, MC>> {
    using type = E;
};
template <class E> struct ElementOf<Array<E>> { using type = E; };
template <int symbol> struct ElementOf<AnyOf<symbol>> { using type = double; };

} // namespace bf
