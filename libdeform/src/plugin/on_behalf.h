// During its lifetime, messages that a plugin logs on this thread name the body for which it was called.
#pragma once
#include <string>

namespace dfm {

class OnBehalf {
 public:
  explicit OnBehalf(const std::string &body) noexcept : outer_(now_) { now_ = &body; }
  ~OnBehalf() { now_ = outer_; }
  OnBehalf(const OnBehalf &) = delete;
  OnBehalf &operator=(const OnBehalf &) = delete;
  static const std::string *body() noexcept { return now_; }  // null: no body

 private:
  static thread_local const std::string *now_;
  const std::string *outer_;
};

}  // namespace dfm
