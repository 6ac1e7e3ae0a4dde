// What C++20 has and LLVM's standard library lacks, as far as it is used here: versions below 20 (macOS,
// Debian's packages), and 13, that of Debian 12's emscripten. Every file of a build with such a version
// includes it first.
#pragma once
#ifdef __cplusplus
#include <algorithm>
#include <cerrno>
#include <charconv>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#if !defined(__EMSCRIPTEN__)
#include <locale.h>
#if __has_include(<xlocale.h>)
#include <xlocale.h>
#endif
#endif
#include <functional>
#include <iterator>
#include <memory>
#include <ranges>
#include <string>
#include <utility>
#include <version>

namespace std {

#ifndef __cpp_lib_bit_cast
template <class To, class From>
constexpr To bit_cast(const From &from) noexcept {
  return __builtin_bit_cast(To, from);
}
#endif

#if _LIBCPP_VERSION < 16000
template <class T>
unique_ptr<T> make_unique_for_overwrite(size_t n) {
  return unique_ptr<T>(new remove_extent_t<T>[n]);
}
#endif

#if _LIBCPP_VERSION < 15000
namespace ranges {

template <class Less, class Projection>
auto projected_less(Less less, Projection p) {
  return [less, p](const auto &a, const auto &b) {
    return std::invoke(less, std::invoke(p, a), std::invoke(p, b));
  };
}
template <class R, class Less = std::less<>, class P = identity>
void sort(R &&r, Less less = {}, P p = {}) {
  std::sort(std::begin(r), std::end(r), projected_less(less, p));
}
template <class R, class Less = std::less<>, class P = identity>
void stable_sort(R &&r, Less less = {}, P p = {}) {
  std::stable_sort(std::begin(r), std::end(r), projected_less(less, p));
}
template <class R, class Less = std::less<>, class P = identity>
bool is_sorted(R &&r, Less less = {}, P p = {}) {
  return std::is_sorted(std::begin(r), std::end(r), projected_less(less, p));
}
template <class R, class T, class Less = std::less<>, class P = identity>
auto lower_bound(R &&r, const T &value, Less less = {}, P p = {}) {
  return std::lower_bound(std::begin(r), std::end(r), value,
                          [&](const auto &a, const T &b) { return std::invoke(less, std::invoke(p, a), b); });
}
template <class R, class T, class P = identity>
auto find(R &&r, const T &value, P p = {}) {
  return std::find_if(std::begin(r), std::end(r), [&](const auto &a) { return std::invoke(p, a) == value; });
}
template <class R, class T, class Less = std::less<>, class P = identity>
auto upper_bound(R &&r, const T &value, Less less = {}, P p = {}) {
  return std::upper_bound(std::begin(r), std::end(r), value,
                          [&](const T &b, const auto &a) { return std::invoke(less, b, std::invoke(p, a)); });
}
template <class R, class Good, class P = identity>
auto find_if(R &&r, Good good, P p = {}) {
  return std::find_if(std::begin(r), std::end(r),
                      [&](const auto &a) { return std::invoke(good, std::invoke(p, a)); });
}
template <class R, class T, class P = identity>
auto count(R &&r, const T &value, P p = {}) {
  return std::count_if(std::begin(r), std::end(r), [&](const auto &a) { return std::invoke(p, a) == value; });
}
template <class R, class Good, class P = identity>
bool any_of(R &&r, Good good, P p = {}) {
  return ranges::find_if(r, good, p) != std::end(r);
}
template <class R, class Good>
bool all_of(R &&r, Good good) {
  return std::all_of(std::begin(r), std::end(r), [&](const auto &a) { return std::invoke(good, a); });
}
template <class R, class Good>
bool none_of(R &&r, Good good) {
  return !ranges::any_of(r, good);
}
template <class R, class Good>
auto count_if(R &&r, Good good) {
  return std::count_if(std::begin(r), std::end(r), [&](const auto &a) { return std::invoke(good, a); });
}
template <class R, class Good, class P = identity>
auto adjacent_find(R &&r, Good good, P p = {}) {
  return std::adjacent_find(std::begin(r), std::end(r), projected_less(good, p));
}
template <class R, class S, class Same = std::equal_to<>, class P = identity, class Q = identity>
bool equal(R &&r, S &&s, Same same = {}, P p = {}, Q q = {}) {
  return std::equal(
      std::begin(r), std::end(r), std::begin(s), std::end(s),
      [&](const auto &a, const auto &b) { return std::invoke(same, std::invoke(p, a), std::invoke(q, b)); });
}
template <class R, class Out>
void copy(R &&r, Out out) {
  std::copy(std::begin(r), std::end(r), out);
}
template <class R, class T>
void fill(R &&r, const T &value) {
  std::fill(std::begin(r), std::end(r), value);
}
template <class R>
auto min(R &&r) {
  return *std::min_element(std::begin(r), std::end(r));
}
template <class R>
auto max(R &&r) {
  return *std::max_element(std::begin(r), std::end(r));
}

}  // namespace ranges
#endif

#if _LIBCPP_VERSION < 200000
// Not by the locale of the program.
inline double number_at(const char *text, char **end) {
#ifdef __EMSCRIPTEN__
  return std::strtod(text, end);
#else
  static const locale_t plain = newlocale(LC_NUMERIC_MASK, "C", locale_t{});
  return strtod_l(text, end, plain);
#endif
}
// By strtod, which rounds as from_chars has to; it takes white space, "+" and hexadecimal digits too.
inline from_chars_result from_chars(const char *first, const char *last, double &value) {
  size_t n = 0;
  while (first + n < last && std::strchr("+-.0123456789eEINFAinfaTYty", first[n]) && first[n]) ++n;
  const std::string text(first, n);
  if (text.empty() || text[0] == '+') return {first, errc::invalid_argument};
  char *end = nullptr;
  errno = 0;
  const double x = number_at(text.c_str(), &end);
  const char *const behind = first + (end - text.c_str());
  if (behind == first) return {first, errc::invalid_argument};
  if (errno == ERANGE) return {behind, errc::result_out_of_range};
  value = x;
  return {behind, errc()};
}
#endif

#if _LIBCPP_VERSION < 14000
// The fewest digits that are read as the same number, as 1500 or 1.5e+03: what is shorter.
inline to_chars_result to_chars(char *first, char *last, double value) {
  char far[40], near[400];
  int digits = 14;  // behind the point
  do std::snprintf(far, sizeof far, "%.*e", digits, value);
  while (std::strtod(far, nullptr) != value && value == value && ++digits < 17);
  const char *shown = far;
  if (char *const e = std::strchr(far, 'e')) {
    char *from = e;
    while (from[-1] == '0') --from;
    if (from[-1] == '.') --from;
    const int power = std::atoi(e + 1), kept = static_cast<int>(from - far) - (value < 0 || far[0] == '-');
    std::memmove(from, e, std::strlen(e) + 1);
    const int behind = (kept > 1 ? kept - 2 : 0) - power;
    std::snprintf(near, sizeof near, "%.*f", behind > 0 ? behind : 0, value);
    if (std::strlen(near) <= std::strlen(far)) shown = near;
  }
  const size_t n = std::strlen(shown);
  if (static_cast<size_t>(last - first) < n) return {last, errc::value_too_large};
  std::memcpy(first, shown, n);
  return {first + n, errc()};
}
#endif

}  // namespace std
#endif
