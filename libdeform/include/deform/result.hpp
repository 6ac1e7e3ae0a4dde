// deform/result.hpp -- parts of the classes of deform.hpp: error reports, arguments without cost, handles
// that destroy what they own. Included by deform.hpp.
#ifndef DEFORM_RESULT_HPP
#define DEFORM_RESULT_HPP
#if !defined(__cplusplus) || __cplusplus < 202002L
#error "deform/deform.hpp needs C++20 (-std=c++20); from C and older C++ include deform/deform.h"
#endif
#include <array>
#include <cstddef>
#include <cstdint>
#include <exception>
#include <span>
#include <stdexcept>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include "deform/base.h"
#include "deform/id.h"

namespace deform {

// ---- small types ------------------------------------------------------------------------------------------
using Vec3 = std::array<double, 3>;
using In3 = std::span<const double, 3>;  // takes Vec3 and double[3]

// A string that the C API reads: a literal or a std::string. Its end is a NUL.
struct Text {
  const char *c_str;
  constexpr Text(const char *s) noexcept : c_str(s) {}
  Text(const std::string &s) noexcept : c_str(s.c_str()) {}
};

// Up to three lengths of a generated shape: {0.1}, {0.1, 0.4}, {0.1, 0.2, 0.3}.
struct Size {
  double m[3];
  constexpr Size(double a, double b = 0, double c = 0) noexcept : m{a, b, c} {}
};

// A struct of the C API that starts with its size, all else zero.
template <class T>
constexpr T sized() noexcept {
  T t{};
  t.size = sizeof(T);
  return t;
}

// Parameters by key, without allocation: `const deform::Params p({{"mu_C", 0.4}, {"mu_S", 0.5}});` then p
// where dfm_params is wanted.
struct Param {
  const char *key;
  double value;
};
template <size_t N>
class Params {
 public:
  constexpr explicit Params(const Param (&given)[N]) noexcept {
    for (size_t i = 0; i < N; ++i) {
      value_[i] = given[i].value;
      row_[i] = {given[i].key, &value_[i], 1};
    }
  }
  Params(const Params &) = delete;  // rows point at the values beside them
  Params &operator=(const Params &) = delete;
  operator dfm_params() const noexcept { return {sizeof(dfm_params), N, row_}; }

 private:
  double value_[N];
  dfm_param_value row_[N];
};

// ---- errors -----------------------------------------------------------------------------------------------
// Two spans of one call disagree in length; no C function was called.
inline constexpr dfm_status spans_disagree = -1000;

inline const char *version() noexcept { return dfm_version(nullptr, nullptr, nullptr); }
inline const char *status_name(dfm_status s) noexcept {
  return s == spans_disagree ? "spans_disagree" : dfm_status_name(s);
}
// DFM_HANDLE_*: what a handle refers to that a report gives as a number.
inline uint32_t handle_kind(uint64_t handle) noexcept { return dfm_handle_kind(handle); }
// The sentence that belongs to s, the status of this thread's last call that failed.
inline const char *sentence(dfm_status s) noexcept {
  return s == spans_disagree
             ? "two arrays of one call disagree in length: each point or item needs its row in both"
             : dfm_last_error();
}

// For bindings: sets that sentence.
inline dfm_status fail(dfm_status s, const char *why) noexcept { return dfm_fail(s, why); }
// For bindings: files as the library reads and writes its own. take(bytes, n) is called once and
// does not throw.
template <class Take>
dfm_status read_file(const char *path, uint64_t limit, const char *expected, Take &&take) noexcept {
  const auto call = [](void *user, const char *bytes, size_t n) {
    (*static_cast<std::remove_reference_t<Take> *>(user))(bytes, n);
  };
  return dfm_file_read(path, limit, expected, call, const_cast<void *>(static_cast<const void *>(&take)));
}
inline dfm_status write_file(const char *path, const void *bytes, size_t n) noexcept {
  return dfm_file_write(path, bytes, n);
}

// Whether a call that gives T was done. DFM_DISCARD is no error where T says it: StepReport, the bool of a
// law.
template <class T>
constexpr bool is_done(dfm_status s) noexcept {
  return s == DFM_OK || (s > 0 && (std::is_same_v<T, bool> || requires { std::declval<T &>().discarded; }));
}

// A status with what the call gives. `if (result) use(*result); else log(result.what());`
template <class T>
class [[nodiscard]] Result {
 public:
  constexpr explicit operator bool() const noexcept { return is_done<T>(status_); }
  constexpr dfm_status status() const noexcept { return status_; }
  // Read it before this thread's next call that fails. "" where this one did not.
  const char *what() const noexcept { return *this ? "" : sentence(status_); }
  // As the C function left it where the call failed: zero, or a handle that refers to nothing.
  constexpr T &operator*() & noexcept { return value_; }
  constexpr const T &operator*() const & noexcept { return value_; }
  constexpr T &&operator*() && noexcept { return std::move(value_); }
  constexpr T *operator->() noexcept { return &value_; }
  constexpr const T *operator->() const noexcept { return &value_; }
  constexpr T value_or(T other) && { return *this ? std::move(value_) : std::move(other); }

 private:
  friend struct Values;
  constexpr Result() noexcept : value_() {}  // status_ is written by Values::end
  T value_;
  dfm_status status_;
};
template <>
class [[nodiscard]] Result<void> {
 public:
  constexpr explicit operator bool() const noexcept { return is_done<void>(status_); }
  constexpr dfm_status status() const noexcept { return status_; }
  const char *what() const noexcept { return *this ? "" : sentence(status_); }

 private:
  friend struct Values;
  constexpr explicit Result(dfm_status s) noexcept : status_(s) {}
  dfm_status status_;
};

// Errors as values.
struct Values {
  template <class T>
  using Out = Result<T>;
  static constexpr Result<void> done(dfm_status s) noexcept { return Result<void>(s); }
  template <class T>
  static constexpr Result<T> begin() noexcept {
    return Result<T>();
  }
  template <class T>
  static constexpr T &slot(Result<T> &r) noexcept {
    return r.value_;
  }
  template <class T>
  static constexpr void end(Result<T> &r, dfm_status s) noexcept {
    r.status_ = s;
  }

  // A callable handed through the C API; it must not throw.
  template <class F>
  struct Call {
    F &f;
    template <class... A>
    void operator()(A &&...a) noexcept {
      f(std::forward<A>(a)...);
    }
    void rethrow() noexcept {}
  };
};

#if defined(__cpp_exceptions)
class Error : public std::runtime_error {
 public:
  explicit Error(dfm_status s) : std::runtime_error(sentence(s)), status_(s) {}
  dfm_status status() const noexcept { return status_; }

 private:
  dfm_status status_;
};

// Errors as exceptions.
struct Throw {
  template <class T>
  using Out = T;
  // Out of line: its callers cost a test and a jump, as in C.
  [[noreturn, gnu::cold, gnu::noinline]] static void raise(dfm_status s) { throw Error(s); }
  template <class T = void>
  static void done(dfm_status s) {
    if (!is_done<T>(s)) [[unlikely]]
      raise(s);
  }
  template <class T>
  static constexpr T begin() {
    return T();
  }
  template <class T>
  static constexpr T &slot(T &r) noexcept {
    return r;
  }
  template <class T>
  static void end(T &, dfm_status s) {
    done<T>(s);
  }

  // A callable handed through the C API: what it throws waits on this side of it, and the remaining
  // calls pass it by.
  template <class F>
  struct Call {
    F &f;
    std::exception_ptr thrown = nullptr;
    template <class... A>
    void operator()(A &&...a) noexcept {
      if (thrown) return;
      try {
        f(std::forward<A>(a)...);
      } catch (...) {
        thrown = std::current_exception();
      }
    }
    void rethrow() {
      if (thrown) std::rethrow_exception(thrown);
    }
  };
};
#endif

// Ends what a handle refers to. As large as the handle.
template <class Ref>
class Unique : public Ref {
 public:
  Unique() = default;
  explicit Unique(Ref r) noexcept : Ref(r) {}
  Unique(Unique &&other) noexcept : Ref(other.release()) {}
  Unique &operator=(Unique &&other) noexcept {
    reset(other.release());
    return *this;
  }
  Unique(const Unique &) = delete;
  Unique &operator=(const Unique &) = delete;
  ~Unique() { reset(); }
  [[nodiscard]] Ref release() noexcept { return std::exchange(static_cast<Ref &>(*this), Ref()); }
  void reset(Ref other = Ref()) noexcept {
    const Ref old = std::exchange(static_cast<Ref &>(*this), other);
    if (old) Ref::end(old.get());
  }
};

// How the classes call the C functions. E: Throw or Values.
namespace basic {

template <class E, class T, class F>
// the type by name: clang 14 copies a result whose type is deduced
inline typename E::template Out<T> produce(F &&f) {
  typename E::template Out<T> r = E::template begin<T>();
  E::end(r, f(E::slot(r)));
  return r;
}
constexpr uint32_t rows(size_t numbers, uint32_t width) noexcept {
  return static_cast<uint32_t>(numbers / width);
}
// An empty span may have memory behind it that nobody means.
template <class T>
constexpr T *given(std::span<T> values) noexcept {
  return values.empty() ? nullptr : values.data();
}

// [n, W] numbers through one of the counted functions: into the caller's memory, returning n, or
// into a vector.
template <class E, uint32_t W, class T>
inline auto fill(dfm_status (*f)(uint64_t, uint32_t, T *, uint32_t *), uint64_t handle,
                 std::span<std::type_identity_t<T>> out) {
  return produce<E, uint32_t>([&](uint32_t &n) { return f(handle, rows(out.size(), W), out.data(), &n); });
}
template <class E, uint32_t W, class T>
inline auto collect(dfm_status (*f)(uint64_t, uint32_t, T *, uint32_t *), uint64_t handle) {
  return produce<E, std::vector<T>>([&](std::vector<T> &out) {
    uint32_t n = 0;
    const dfm_status s = f(handle, 0, nullptr, &n);
    if (s < 0 || n == 0) return s;
    out.resize(size_t{W} * n);
    return f(handle, n, out.data(), &n);
  });
}
// The same for lists of structs, with the row size of this header.
template <class E, class T>
inline auto fill_rows(dfm_status (*f)(uint64_t, uint32_t, uint32_t, T *, uint32_t *), uint64_t handle,
                      std::span<std::type_identity_t<T>> out) {
  return produce<E, uint32_t>([&](uint32_t &n) {
    return f(handle, static_cast<uint32_t>(sizeof(T)), rows(out.size(), 1), out.data(), &n);
  });
}
template <class E, class T>
inline auto collect_rows(dfm_status (*f)(uint64_t, uint32_t, uint32_t, T *, uint32_t *), uint64_t handle) {
  return produce<E, std::vector<T>>([&](std::vector<T> &out) {
    constexpr uint32_t size = static_cast<uint32_t>(sizeof(T));
    uint32_t n = 0;
    const dfm_status s = f(handle, size, 0, nullptr, &n);
    if (s < 0 || n == 0) return s;
    out.resize(n);
    return f(handle, size, n, out.data(), &n);
  });
}
template <class E, class Ref>
inline auto collect_handles(dfm_status (*f)(uint64_t, uint32_t, uint64_t *, uint32_t *), uint64_t handle) {
  return produce<E, std::vector<Ref>>([&](std::vector<Ref> &out) {
    uint32_t n = 0;
    dfm_status s = f(handle, 0, nullptr, &n);
    if (s < 0 || n == 0) return s;
    std::vector<uint64_t> raw(n);
    s = f(handle, n, raw.data(), &n);
    if (s >= 0) out.reserve(n);
    for (size_t i = 0; s >= 0 && i < n; ++i) out.push_back(Ref(raw[i]));
    return s;
  });
}
// Text and blobs: asked for their size first.
template <class E, class F>
inline auto collect_text(F &&f) {
  return produce<E, std::string>([&](std::string &out) {
    size_t bytes = 0;
    dfm_status s = f(nullptr, &bytes);
    if (s < 0 || bytes == 0) return s;
    out.resize(bytes);
    s = f(out.data(), &bytes);
    out.resize(s >= 0 && bytes ? bytes - 1 : 0);  // without the NUL
    return s;
  });
}
template <class E, class F>
inline auto collect_bytes(F &&f) {
  return produce<E, std::vector<std::byte>>([&](std::vector<std::byte> &out) {
    size_t bytes = 0;
    const dfm_status s = f(nullptr, &bytes);
    if (s < 0) return s;
    out.resize(bytes);
    return f(out.data(), &bytes);
  });
}

// A handle's value. Raw is what the C functions take; Kind keeps handles of different things apart, which in
// C have one type.
template <class Raw, class Kind>
class Handle {
 public:
  constexpr Handle() = default;
  constexpr explicit Handle(Raw raw) noexcept : raw_(raw) {}
  constexpr Raw get() const noexcept { return raw_; }
  constexpr Raw *put() noexcept { return &raw_; }  // for C functions with an out parameter
  constexpr explicit operator bool() const noexcept { return raw_ != Raw{}; }
  friend constexpr bool operator==(Handle, Handle) = default;

 protected:
  Raw raw_{};
};

}  // namespace basic
}  // namespace deform
#endif
