#include "plugin/scratch.h"

#include <algorithm>
#include <atomic>

namespace dfm {
namespace {

constexpr size_t kAlign = 64, kFirstChunk = 16384;

uint64_t next_serial() {
  static std::atomic<uint64_t> serial{0};
  return ++serial;
}

struct Cache {
  uint64_t serial = 0;
  ScratchArena *arena = nullptr;
};
thread_local Cache cache;

}  // namespace

ScratchArena::~ScratchArena() { drop_all(); }

void ScratchArena::drop_all() noexcept {
  for (const Chunk &chunk : chunks_) memory_.release(memory_.user, chunk.data, chunk.bytes, kAlign);
  chunks_.clear();
}

bool ScratchArena::grow(size_t bytes) noexcept {
  size_t end = chunks_.empty() ? 0 : chunks_.back().begin + chunks_.back().bytes;
  size_t want = std::max({bytes, kFirstChunk, end});  // doubles, so the number of chunks stays small
  if (used_ == 0) {  // not in use: one larger chunk replaces the chunks of the last call
    drop_all();
    end = 0;
  }
  try {
    chunks_.reserve(chunks_.size() + 1);
  } catch (...) {
    return false;
  }
  char *data = static_cast<char *>(memory_.alloc(memory_.user, want, kAlign));
  if (!data) return false;
  chunks_.push_back({data, end, want});
  return true;
}

void *ScratchArena::take(size_t bytes) noexcept {
  if (bytes > SIZE_MAX / 4) return nullptr;
  bytes = std::max(kAlign, (bytes + kAlign - 1) / kAlign * kAlign);
  for (const Chunk &chunk : chunks_) {
    const size_t at = std::max(used_, chunk.begin);
    if (at + bytes <= chunk.begin + chunk.bytes) {
      used_ = at + bytes;
      return chunk.data + (at - chunk.begin);
    }
  }
  if (!grow(bytes)) return nullptr;
  used_ = chunks_.back().begin + bytes;
  return chunks_.back().data;
}

void ScratchArena::reset(size_t mark) noexcept {
  used_ = mark;
  if (used_ != 0 || chunks_.size() < 2) return;
  const size_t total = chunks_.back().begin + chunks_.back().bytes;
  drop_all();
  grow(total);
}

Scratch::Scratch(const Memory &memory) : memory_(memory), serial_(next_serial()) {}

Scratch::~Scratch() {
  for (const Owned &owned : arenas_) delete owned.arena;
}

ScratchArena *Scratch::arena() noexcept {
  if (cache.serial == serial_) return cache.arena;
  try {
    const std::lock_guard lock(mutex_);
    const auto self = std::this_thread::get_id();
    auto found =
        std::find_if(arenas_.begin(), arenas_.end(), [&](const Owned &o) { return o.thread == self; });
    if (found == arenas_.end()) {
      arenas_.reserve(arenas_.size() + 1);
      arenas_.push_back({self, new ScratchArena(memory_)});
      found = arenas_.end() - 1;
    }
    cache = {serial_, found->arena};
    return found->arena;
  } catch (...) {
    return nullptr;
  }
}

}  // namespace dfm
