// What becomes of each label: a small JSON file, or defaults.
#pragma once
#include "json_text.h"
#include "label_volume.h"

namespace labels {

struct Entry {
  uint16_t label = 0;    // index into Volume::value
  std::string name;      // of the label: letters, digits, '_', '-', '.', what is not ASCII
  size_t thing = 0;      // of Table::things
  std::string material;  // of Table::materials
};
struct Thing {
  std::string name;
  bool obstacle = false;
  std::vector<size_t> entries;  // of Table::entries
  uint32_t cells = 0;           // 0: its share of all
  bool own_boundary = false;    // its surface is the boundary of its cells, so that it can be cut
  cli::JsonValue more;          // further keys of the body in the scene; object or null
};
struct Table {
  std::vector<Entry> entries;  // labels that are kept, ascending
  std::vector<Thing> things;   // in the order of their first label
  cli::JsonValue materials;    // object
  cli::JsonValue scene;        // further keys of the scene; object or null
  std::vector<std::string> warnings;
};

// Checks the file against the labels that the volume has. Throws cli::Failure: file, JSON pointer, what to
// do.
Table read_table(const std::string &path, const Volume &volume);
// Labels that share a border become one body of several materials; all have the same material.
// touch: [n,2] labels that share a border
Table default_table(const Volume &volume, const std::vector<std::array<uint16_t, 2>> &touch);
// The table as a file that read_table reads.
std::string table_text(const Table &table, const Volume &volume);

// Pairs of labels with a voxel face between them, ascending.
std::vector<std::array<uint16_t, 2>> touching_labels(const Volume &volume);

}  // namespace labels
