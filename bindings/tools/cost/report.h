// The study in words and numbers: table for a terminal, cost.csv, cost.json.
#pragma once
#include <string>

#include "study.h"

namespace cli::cost {

std::string table_text(const Subject &subject, const Study &study);
std::string csv_text(const Subject &subject, const Study &study);
std::string json_report(const Subject &subject, const Study &study, const JsonValue &patch);

// "3.2 %"; below a tenth of the resolution "0.0 %"; "-" where there is none.
std::string percent(double part);
// What a choice is in full, with what the scene says where it leaves it.
struct Described {
  std::string model, integrator, law, precision;
  double step = 0;  // s, mean of those taken
};
Described describe(const Subject &subject, const Row &row);
// Sentences on the reference that table and page share.
std::string mesh_text(const Study &study);  // of the scene's own mesh; "" where nothing is said
std::string reference_text(const Study &study);
// What every table says that shows errors: of what, against which run, how far that one may be off.
std::string error_text(const Subject &subject, const Study &study);
std::string short_reference(const Study &study);
std::string pick_text(const Subject &subject, const Study &study);
std::string mesh_doubt(const Study &study);  // of a choice on the scene's own mesh
std::string doubt_text(const Study &study);  // why a choice for all meshes is likely, not proven
std::string next_step(const Study &study);   // which budget says more, and what
// Why --apply writes nothing: there is no choice, or it is not proven; "" where it writes.
std::string refusal_to_apply(const Study &study);
// Choices that are not compared: one sentence for each reason, with who and why.
std::vector<std::string> left_out(const Subject &subject, const Study &study);

}  // namespace cli::cost
