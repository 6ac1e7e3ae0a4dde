// Scratch memory lent to plugins: one bump arena per thread and context, in memory of the context's hooks. A
// PluginCall around each call into a plugin returns the memory of that call: all pieces of one call are valid
// together, and nothing is allocated after the largest call.
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

  void *take(size_t bytes) noexcept;  // 64-byte aligned; nullptr if there is no memory
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
  ScratchArena *arena() noexcept;  // of this thread; nullptr if there is no memory

 private:
  struct Owned {
    std::thread::id thread;
    ScratchArena *arena;
  };
  const Memory &memory_;
  const uint64_t serial_;  // unique, unlike the address, which a later context may reuse
  std::mutex mutex_;
  std::vector<Owned> arenas_;
};

// An object of this type surrounds every call into a plugin.
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
