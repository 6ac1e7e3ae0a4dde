// The study of one scene: which choices are run within the budget, what they are compared with, and what
// follows: errors by axis, the front of time against error, and the cheapest choice that is good enough.
#pragma once
#include <map>
#include <string>
#include <vector>

#include "axes.h"
#include "quantities.h"
#include "richardson.h"
#include "runs.h"

namespace cli::cost {

struct StudyOptions {
  std::vector<std::string> quantities, axes;  // as given; empty: probes, all axes
  double target = 0.05, budget = 60;
};

struct Row {
  Candidate candidate;
  Job job;
  std::map<std::string, double> error;  // by quantity, relative; NaN where it cannot be said
  double headline = 0;                  // the largest of the given quantities; NaN: none
  double cpu_per_s = 0;                 // s of processor time for a simulated one, or for an equilibrium
  bool alone = false;                   // timed with nothing beside it
  std::string picture;                  // file: the scene at its end; "" where there is none
  bool compared = false;                // done, with figures
};

// One change at a time from the scene as it is: how far a choice is from the axis' own finest one.
struct Separated {
  std::string axis, kind;
  size_t anchor = 0;
  std::vector<std::pair<size_t, double>> rows;
};

// What is said about the scene's own mesh, where that is one of several: model and step, against the
// reference's model on the same mesh in short steps.
struct OnThisMesh {
  int reference = -1, check = -1;  // rows: half the scene's explicit step, and as long ones as are stable
  double own = 0;                  // error of the reference, by the other one
  double mesh = 0;                 // of the reference from that of all meshes: what the mesh brings
  std::map<size_t, double> error;  // by row
  std::vector<size_t> front;
  int pick = -1;
};

struct Study {
  StudyOptions options;
  Axes axes;
  std::vector<Row> rows;  // the scene as it is comes first
  std::map<std::string, double> scales;
  std::map<std::string, std::string> units;
  std::vector<std::string> quantities, headline;  // all; the given ones
  std::vector<std::string> zeros;  // asked for, and 0 in the reference, so that no error is relative to it
  std::map<std::string, double> until;            // s: the last record of a probe that a cut has taken
  int reference = -1, check = -1, third = -1;     // rows: the finest, and those that it is checked by
  std::map<std::string, Limit> limits;            // by quantity: what the three say
  std::map<std::string, double> reference_error;  // of the reference
  double reference_headline = 0, best = 0;        // best: least error of the other choices
  double reference_bound = 0;  // of reference_headline, as large as it may be; inf: nothing bounds it
  bool converged = false;
  const char *cost_unit = "s per s";  // of cpu_per_s; "s" of a static scene, whose run costs that
  std::vector<Separated> separated;
  std::vector<size_t> front;  // by rising cost
  OnThisMesh own_mesh;
  int pick = -1;
  bool mesh_stays = false;  // the pick is that of own_mesh: nothing holds for all meshes
  bool proven = false;      // the pick meets the target even if the reference is as far off as it may be
  double used = 0;          // s of the budget
  unsigned started = 0;
  // The cheapest thing that would say more, and the budget (s) with which the same call goes on to it; 0: not
  // known.
  std::string next;
  double next_budget = 0;
  bool finest = false;  // no finer reference is tried, whatever the budget is
};

// Throws Failure where nothing can be compared within the budget.
Study make_study(const Subject &subject, const std::string &mesh_left_out, const StudyOptions &options,
                 Runs &runs);

// meshes.cpp: why the cells of this scene's bodies cannot vary; "" where they can.
std::string why_cells_stay(const Subject &subject);

// patch.cpp: the own settings of a choice, without what every run records; and what makes it from the file,
// in which the planner's choice is not yet fixed. Empty: the scene as it is.
Settings own_settings(const Row &row);
Settings settings_of_file(const Subject &subject, const Row &row);
// The choice as a JSON merge patch (RFC 7396), and as a scene.
// It contains whole lists, because a merge patch cannot change a part of one. Null: nothing is chosen.
JsonValue scene_patch(const Subject &subject, const Study &study);
// Writes the scene with the pick's changes to `path`. Files keep their places: names are made relative to
// the new scene's folder.
void write_applied(const Subject &subject, const Study &study, const std::string &path);

// page.cpp: cost.html, the study on one page in one file, pictures included; needs no network and no script.
std::string page_html(const Subject &subject, const Study &study);
std::string escaped(const std::string &text);  // for HTML and SVG

}  // namespace cli::cost
