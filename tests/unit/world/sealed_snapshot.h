// Forged snapshots of a world whose length and checksum hold; the fuzz program uses it too.
#pragma once
#include <cstdint>
#include <cstring>
#include <vector>

#include "snapshot/snapshot_stream.h"

namespace test {

inline void seal(std::vector<uint8_t> &b) {
  dfm::SnapshotHead head;
  if (b.size() < sizeof head) return;
  std::memcpy(&head, b.data(), sizeof head);
  head.length = b.size();
  std::memcpy(b.data(), &head, sizeof head);
  head.checksum = dfm::snapshot_checksum(b.data(), b.size());
  std::memcpy(b.data(), &head, sizeof head);
}

}  // namespace test
