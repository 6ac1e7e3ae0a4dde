// A child of fork() has the memory of its parent and one thread. Whoever owns threads compares the count with
// that of the time when they were started: in a child they are not there, to be called or to be waited for.
#pragma once
#include <cstdint>

namespace dfm {

// How many forks lie between the process that asked first and this one; 0 where the system tells none.
uint32_t forks() noexcept;

}  // namespace dfm
