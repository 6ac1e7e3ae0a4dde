// Scratch memory lent to plugins: one bump arena per thread and context, in memory of the context's hooks. A
// PluginCall around each call into a plugin gives back what that call took, so several pieces of one call are
// valid together, and nothing is allocated once the largest call has been seen.
#pragma once
#include <cstddef>
#include <cstdint>
#include <mutex>
#include <thread>
#include <vector>

#include "core/memory.h"

namespace dfm {

class ScratchArena {
 public:
  explicit ScratchArena(const Memory &memory) : memory_(memory) {}
  ~ScratchArena();
  ScratchArena(const ScratchArena &) = delete;
  ScratchArena &operator=(const ScratchArena &) = delete;

  void *take(size_t bytes) noexcept;  // 64-byte aligned; nullptr where memory is refused
  size_t mark() const { return used_; }
  void reset(size_t mark) noexcept;
  uint32_t depth = 0;  // open PluginCalls of this thread

 private:
  // covers offsets [begin, begin + bytes) of the arena
  struct Chunk {
    char *data;
    size_t begin, bytes;
  };
  bool grow(size_t bytes) noexcept;
  void drop_all() noexcept;
  const Memory &memory_;
  std::vector<Chunk> chunks_;
  size_t used_ = 0;
};

// The arenas of one context.
class Scratch {
 public:
  explicit Scratch(const Memory &memory);
  ~Scratch();
  ScratchArena *arena() noexcept;  // of this thread; nullptr where memory is refused

 private:
  struct Owned {
    std::thread::id thread;
    ScratchArena *arena;
  };
  const Memory &memory_;
  const uint64_t serial_;  // an address may be used again by a later context, a serial number never
  std::mutex mutex_;
  std::vector<Owned> arenas_;
};

// Every call into a plugin stands inside one of these.
class PluginCall {
 public:
  explicit PluginCall(Scratch &scratch) noexcept : arena_(scratch.arena()) {
    if (arena_) {
      mark_ = arena_->mark();
      ++arena_->depth;
    }
  }
  ~PluginCall() {
    if (arena_) {
      --arena_->depth;
      arena_->reset(mark_);
    }
  }
  PluginCall(const PluginCall &) = delete;
  PluginCall &operator=(const PluginCall &) = delete;

 private:
  ScratchArena *arena_;
  size_t mark_ = 0;
};

}  // namespace dfm
