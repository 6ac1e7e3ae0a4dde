// Writes a snapshot.
#include "world/snapshot.h"

#include <cstring>

#include "world/snapshot_cuts.h"
#include "world/snapshot_fields.h"
#include "world/snapshot_structure.h"
#include "world/snapshot_things.h"

namespace dfm {

void world_snapshot(const World &w, std::vector<unsigned char> &out, std::vector<SnapshotField> *map) {
  out.resize(sizeof(SnapshotHead));
  SnapshotWriter s(out, map);
  const ThingRows things = thing_rows(w);
  thing_fields(s, things);
  const std::vector<CutRow> cuts = cut_rows(w);
  cut_fields(s, cuts);
  snapshot::fields(s, w, w);
  SnapshotHead head{{}, kSnapshotVersion, 0, out.size(), rest_of_structure(w), 0};
  std::memcpy(head.magic, kSnapshotMagic, sizeof head.magic);
  std::memcpy(out.data(), &head, sizeof head);
  head.checksum = snapshot_checksum(out.data(), out.size());
  std::memcpy(out.data(), &head, sizeof head);
}

}  // namespace dfm
