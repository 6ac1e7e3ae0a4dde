#include <windows.h>

#include <fcntl.h>
#include <io.h>
#include <process.h>

#include <cstdio>

#include "check/process.h"
#include "messages.h"
#include "system.h"
#include "system_windows.h"

namespace cli::check {
namespace {

double seconds_of(const FILETIME &time) {
  return 1e-7 * double(uint64_t(time.dwHighDateTime) << 32 | time.dwLowDateTime);
}

double processor_time(HANDLE process) {
  FILETIME begun, ended, system, own;
  if (!GetProcessTimes(process, &begun, &ended, &system, &own)) return 0;
  return seconds_of(system) + seconds_of(own);
}

std::string ending_of(DWORD code) {
  switch (code) {
    case EXCEPTION_ACCESS_VIOLATION:
      return "ended its process (it accessed memory that does not belong to it)";
    case EXCEPTION_INT_DIVIDE_BY_ZERO: return "ended its process (a whole number was divided by zero)";
    case EXCEPTION_ILLEGAL_INSTRUCTION: return "ended its process (an instruction that this processor lacks)";
    case EXCEPTION_STACK_OVERFLOW: return "ended its process (its stack was full)";
    case 3: return "ended its process (it called abort, or threw through a C function)";
    default: return text("left its process by itself with exit code %lu", code);
  }
}

// A pipe whose writing end the child gets.
struct Pipe {
  Pipe() {
    if (_pipe(ends, 65536, _O_BINARY | _O_NOINHERIT) != 0) throw Failure(kBadInput, kNoPipe);
  }
  ~Pipe() {
    for (const int end : ends) _close(end);
  }
  template <class Take>
  void take(Take take) {
    char buffer[4096];
    for (DWORD there = 0; PeekNamedPipe(reinterpret_cast<HANDLE>(_get_osfhandle(ends[0])), nullptr, 0,
                                        nullptr, &there, nullptr) &&
                          there > 0;)
      if (const int n = _read(ends[0], buffer, unsigned(std::min<DWORD>(there, sizeof buffer))); n > 0)
        take(buffer, size_t(n));
      else return;
  }
  int ends[2];
};

// While it lives, a descriptor of this process is another file's.
struct Redirected {
  Redirected(int descriptor, int file) : number(descriptor), saved(_dup(descriptor)) {
    _dup2(file, descriptor);
  }
  ~Redirected() {
    _dup2(saved, number);
    _close(saved);
  }
  int number, saved;
};

}  // namespace

void keep_from_children(int descriptor) {
  SetHandleInformation(reinterpret_cast<HANDLE>(_get_osfhandle(descriptor)), HANDLE_FLAG_INHERIT, 0);
}

void suppress_crash_dialogs() {
  SetErrorMode(SEM_FAILCRITICALERRORS | SEM_NOGPFAULTERRORBOX | SEM_NOOPENFILEERRORBOX);
}

Outcome in_own_process(const std::function<void()> &, const std::string &command,
                       const std::vector<std::string> &arguments, const Limits &limits) {
  return in_fresh_process(command, arguments, limits);
}

Outcome in_fresh_process(const std::string &command, std::vector<std::string> arguments,
                         const Limits &limits) {
  Pipe report, output;
  std::fflush(nullptr);
  HANDLE child;
  {
    const int nothing = _open("NUL", _O_RDONLY | _O_NOINHERIT), to_report = _dup(report.ends[1]);
    const Redirected in(0, nothing), out(1, output.ends[1]), error(2, output.ends[1]);
    arguments.insert(arguments.end(), {"--report-to", std::to_string(to_report)});
    child = reinterpret_cast<HANDLE>(os::start(_P_NOWAIT, command, arguments));
    _close(to_report);
    _close(nothing);
  }
  if (child == INVALID_HANDLE_VALUE) throw Failure(kBadInput, kNoProcess);
  // it and what it leaves behind end with the job, and so with this process
  const HANDLE job = CreateJobObjectW(nullptr, nullptr);
  JOBOBJECT_EXTENDED_LIMIT_INFORMATION ends = {};
  ends.BasicLimitInformation.LimitFlags = JOB_OBJECT_LIMIT_KILL_ON_JOB_CLOSE;
  SetInformationJobObject(job, JobObjectExtendedLimitInformation, &ends, sizeof ends);
  AssignProcessToJobObject(job, child);
  Outcome out;
  ChildOutput heard(out);
  TimeLimit limit(limits, out);
  for (bool ended = false; !ended;) {
    ended = WaitForSingleObject(child, 5) == WAIT_OBJECT_0;
    report.take([&](const char *bytes, size_t n) { heard.take_report(bytes, n); });
    output.take([&](const char *bytes, size_t n) { heard.take_output(bytes, n); });
    // whether it waits the system does not say; time on the clock is limited, too
    if (!out.late && limit.ends(processor_time(child), [] { return false; })) TerminateProcess(child, 1);
  }
  CloseHandle(job);
  DWORD code = 0;
  GetExitCodeProcess(child, &code);
  CloseHandle(child);
  if (!out.spoke) out.ending = out.late ? limit.ending() : ending_of(code);
  return out;
}

}  // namespace cli::check
