// The scene whose accuracy is studied: its own text, and what the library says about it.
#pragma once
#include <array>
#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include "cli.h"
#include "json_text.h"

namespace cli::cost {

// A model or law that is loaded.
struct Offered {
  std::string name, id;  // name: short where the scene may say it so
  std::vector<std::string> effects;
  bool second_order = false, lattices = false;  // cells of this kind are accepted by a model
};

struct SubjectBody {
  std::string name, model;                  // short name
  std::vector<std::string> effects;         // those at work
  uint32_t cells = 0;                       // tetrahedra; a second-order one is 8 (dfm_mesh_info)
  double size = 0;                          // m, diagonal of the box around it at the start
  std::vector<std::array<double, 3>> ends;  // rest frame: two points of the surface far from each other
};

struct Subject {
  std::string path, folder;  // of the scene file
  JsonValue given, scene;    // the file's; the same with what the planner chose in place of its wish
  // What makes the one of the other: pointers and JSON text, for --set.
  std::vector<std::pair<std::string, std::string>> planned;
  double duration = 0, step = 0, every = 0;  // s; step 0: "auto"
  double stable = 0;                         // s, in explicit time; 0: nothing bounds it
  bool at_rest = false;                      // static: an equilibrium is sought, nothing moves
  bool implicit = false;                     // any body as the scene is
  bool friction = false, contact = false, probes = false;
  std::vector<SubjectBody> bodies;
  std::vector<Offered> models, laws;
  uint64_t fingerprint = 0;  // of the scene, the files it names and this build of command and library

  // The scene's step, as long as explicit time is stable.
  double explicit_step() const { return step > 0 && step < stable ? step : stable; }
  const Offered *model(const std::string &name) const;
  // Value in the scene's own text; null where it is not given.
  const JsonValue *find(const std::string &pointer) const;
  std::string word(const std::string &pointer, const std::string &otherwise) const;  // a string's text
};

// Throws Failure: the scene cannot be read, or it cannot be studied.
Subject read_subject(const std::string &path, Globals &globals);

// Value at an RFC 6901 pointer; null where nothing is.
const JsonValue *at_pointer(const JsonValue &value, const std::string &pointer);
// Sets it there; objects that are missing are made.
void set_pointer(JsonValue &value, const std::string &pointer, const JsonValue &to);
// The strings in a scene that name files, by their pointers.
std::vector<std::string> file_pointers(const JsonValue &scene);

// FNV-1a 64.
class Hash {
 public:
  Hash &add(const std::string &text);
  Hash &add_file(const std::string &path);  // its name, size and time of change
  uint64_t value() const { return h_; }
  std::string hex() const;

 private:
  uint64_t h_ = 14695981039346656037ull;
};

}  // namespace cli::cost
