#include "check/process.h"

#include <unistd.h>

#include <cerrno>
#include <cstdarg>
#include <cstdio>

namespace cli::check {
namespace {

int report = -1;

std::string formatted(const char *format, va_list args) {
  char buffer[2048];
  std::vsnprintf(buffer, sizeof buffer, format, args);
  return buffer;
}

// A message is a letter, text and a zero: 's' stage, 'P' 'F' 'S' verdict.
void send(char letter, const std::string &what) {
  std::string message = letter + what;
  message.push_back('\0');
  for (size_t at = 0; at < message.size();) {
    const auto n = write(report, message.data() + at, unsigned(message.size() - at));
    if (n < 0 && errno != EINTR) return;
    if (n > 0) at += static_cast<size_t>(n);
  }
}

}  // namespace

std::string text(const char *format, ...) {
  va_list args;
  va_start(args, format);
  std::string out = formatted(format, args);
  va_end(args);
  return out;
}

void broken(const char *format, ...) {
  va_list args;
  va_start(args, format);
  const std::string sentence = formatted(format, args);
  va_end(args);
  throw Broken(sentence);
}

void skip(const char *format, ...) {
  va_list args;
  va_start(args, format);
  const std::string sentence = formatted(format, args);
  va_end(args);
  throw Skipped(sentence);
}

void report_to(int descriptor) {
  report = descriptor;
  if (report >= 0) keep_from_children(report);
}

int reports() { return report; }

void stage(const char *format, ...) {
  if (report < 0) return;
  va_list args;
  va_start(args, format);
  send('s', formatted(format, args));
  va_end(args);
}

void send_verdict(const Verdict &verdict) {
  if (report >= 0)
    send(verdict.result == Result::pass ? 'P' : verdict.result == Result::fail ? 'F' : 'S', verdict.detail);
}

Verdict run_here(const Rule &rule, const Subject &subject) {
  try {
    const uint32_t kind = subject.type ? subject.type->kind : uint32_t(DFM_KIND_FRICTION);
    const auto run = check_for(rule, kind);
    if (!run) return {Result::skip, "does not apply to this kind of plugin"};
    return {Result::pass, run(subject)};
  } catch (const Broken &b) {
    return {Result::fail, b.what()};
  } catch (const Skipped &s) {
    return {Result::skip, s.what()};
  } catch (const std::exception &e) {
    return {Result::fail,
            text("an exception left the plugin (%s); wrap its entries in dfm::plugin::guarded", e.what())};
  } catch (...) {
    return {Result::fail, "an exception left the plugin; wrap its entries in dfm::plugin::guarded"};
  }
}

void ChildOutput::take_report(const char *bytes, size_t n) {
  pending_.append(bytes, n);
  for (size_t end; (end = pending_.find('\0')) != std::string::npos; pending_.erase(0, end + 1)) {
    const char letter = pending_[0];
    const std::string what(pending_, 1, end - 1);
    if (letter == 's') {
      out_.at = what;
    } else {
      out_.spoke = true;
      out_.verdict = {letter == 'P' ? Result::pass : letter == 'F' ? Result::fail : Result::skip, what};
    }
  }
}

void ChildOutput::take_output(const char *bytes, size_t n) {
  if (out_.said.size() < 65536) out_.said.append(bytes, n);
}

bool TimeLimit::ends(double used, const std::function<bool()> &waits) {
  const Clock::time_point clock = Clock::now();
  out_.seconds = used;
  if (used > counted_ + 1e-3) {
    counted_ = used;
    moved_ = clock;
  }
  const std::chrono::duration<double> still = clock - moved_, all = clock - begun_;
  if (still.count() > limits_.still && waits()) waited_ = true;
  out_.late = waited_ || used > limits_.seconds || all.count() > 10 * limits_.seconds;
  return out_.late;
}

std::string TimeLimit::ending() const {
  return waited_
             ? text("did not come back: it has waited for %g s for something that never comes", limits_.still)
             : text("did not come back within %g s", limits_.seconds);
}

std::string same_elsewhere(const Subject &subject, uint64_t digest, const char *kind, const char *input) {
  const std::string number = std::to_string(subject.index), seed = std::to_string(subject.seed);
  const Outcome other =
      in_fresh_process(subject.command, {"plugin", "check", subject.file, "--digest", number, "--seed", seed},
                       {0.5 * subject.limit});
  const std::string mine = text("%016llx", static_cast<unsigned long long>(digest));
  if (!other.spoke)
    broken("in a second process it %s; let the %s depend on its inputs only", other.ending.c_str(), kind);
  if (other.verdict.detail != mine)
    broken(
        "the same %s give %s here and %s in another process; compute from the inputs only, not from "
        "addresses, time or uninitialized memory",
        input, mine.c_str(), other.verdict.detail.c_str());
  return "digest " + mine;
}

}  // namespace cli::check
