#include "case.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>

#include "file.h"
#include "json_text.h"
#include "messages.h"

namespace cli {
namespace {

struct DriveForm {
  const char *kind;
  std::vector<std::string> needed, optional;  // numbers of /input
  std::vector<std::string> columns;           // where the case names none
};

// In the order of Drive.
const std::vector<DriveForm> kDrives = {
    {"bias_sine_force", {"bias", "amp", "freq"}, {"phase"}, {"t", "x", "v", "F", "z"}},
    {"sine_velocity", {"V", "freq"}, {"phase"}, {"t", "x", "v", "F", "z"}},
    {"spring_pull", {"k", "V"}, {}, {"t", "x", "v", "F", "z"}},
    {"force_ramps",
     {},
     {},
     {"rate", "F_ba", "t_ba", "f_applied_at_ba", "interior_peak", "t_v_eq_v_s", "f_applied_v_eq_v_s"}},
    {"displacement_path", {}, {}, {"x", "segment", "F"}},
    {"circle_velocity", {"V", "R"}, {}, {"t", "vx", "vy", "zx", "zy", "Fx", "Fy"}},
    {"turn_velocity", {"V", "t_turn", "turn_angle"}, {}, {"t", "vx", "vy", "zx", "zy", "Fx", "Fy"}},
    {"sine_velocity_sine_load",
     {"F0", "a_open", "freq", "V", "vfreq"},
     {"vphase"},
     {"t", "v", "Fn", "z", "F_elastic", "closed"}},
};
const double kPathSpeed = 1e-5;  // m/s, of a quasi-static path whose case gives none
const int kPathRows = 20;        // of a straight piece, where the case lists no x

// Keys of a case, and of the reference set, which describe it.
const std::vector<std::string> kKeys = {"id",
                                        "about",
                                        "law",
                                        "mass",
                                        "gravity",
                                        "normal_force",
                                        "params",
                                        "input",
                                        "initial",
                                        "output_times",
                                        "T",
                                        "dt",
                                        "columns",
                                        "v_q",
                                        "set",
                                        "rows",
                                        "scenario",
                                        "equation",
                                        "summary",
                                        "method",
                                        "reference_abs_error",
                                        "events",
                                        "path",
                                        "definition",
                                        "prototype_error",
                                        "maxwell_slip",
                                        "memory",
                                        "meaning"};

constexpr uint64_t kMaxBytes = uint64_t(64) << 20;

class CaseReader {
 public:
  explicit CaseReader(const std::string &file) : file_(file) {
    text_ = read_file(file, kMaxBytes, "a friction case (JSON)");
    size_t where = 0;
    if (std::string why; !parse_json(text_, root_, &where, &why)) {
      const auto line =
          1 + std::count(text_.begin(), text_.begin() + long(std::min(where, text_.size())), '\n');
      throw Failure(kBadInput, file + ":" + std::to_string(line) + ": " + why +
                                   "; expected a case as libdeform/doc/reference/friction_rig.md shows it");
    }
    if (root_.kind != JsonValue::object)
      refuse("", "is not an object; expected the keys law, params, input and output_times");
  }

  FrictionCase read() {
    FrictionCase c;
    c.file = file_;
    c.id = root_.get("id");
    c.law = root_.get("law");
    read_kind(c);
    const DriveForm &form = kDrives[size_t(c.drive)];
    c.mass = positive("mass", c.drive == Drive::force || c.drive == Drive::spring || c.drive == Drive::ramps);
    c.gravity = positive("gravity", false);
    read_params(c);
    read_normal_force(c);
    refuse_other_loads(c);
    for (const std::string &key : form.needed) c.input[key] = needed(key);
    for (const std::string &key : form.optional)
      c.input[key] = input_->find(key) ? number_at(*input_->find(key), "/input/" + key) : 0.0;
    if (c.drive == Drive::circle && !(c.input["R"] > 0))
      refuse("/input/R", "is not above 0; expected the radius of the circle in m");
    if (c.drive == Drive::spring && !(c.input["k"] >= 0))
      refuse("/input/k", "is negative; expected the stiffness of the spring in N/m");
    read_initial(c);
    if (c.drive == Drive::path) read_path(c);
    else if (c.drive == Drive::ramps)
      c.times = numbers_at(input("rates", "a list of force rates in N/s"), "/input/rates");
    else read_times(c);
    for (const double rate : c.times)
      if (c.drive == Drive::ramps && !(rate > 0))
        refuse("/input/rates", "holds " + number(rate) + ", expected rates above 0 N/s");
    read_columns(c, form);
    warn_of_keys(form);
    return c;
  }

 private:
  [[noreturn]] void refuse(const std::string &pointer, const std::string &what) const {
    throw Failure(kBadInput, file_ + ": " + (pointer.empty() ? "the document" : pointer) + " " + what);
  }

  double number_at(const JsonValue &v, const std::string &pointer) const {
    char *end = nullptr;
    const double x = std::strtod(v.text.c_str(), &end);
    if (v.kind != JsonValue::literal || v.text.empty() || *end || !std::isfinite(x))
      refuse(pointer, "is " + (v.text.empty() ? std::string("no number") : "\"" + v.text + "\"") +
                          ", expected a finite number");
    return x;
  }

  std::vector<double> numbers_at(const JsonValue &v, const std::string &pointer) const {
    if (v.kind != JsonValue::array || v.items.empty())
      refuse(pointer, "is not a list, expected one of numbers");
    std::vector<double> out;
    for (size_t i = 0; i < v.items.size(); ++i)
      out.push_back(number_at(v.items[i], pointer + "/" + std::to_string(i)));
    return out;
  }

  // A key that is missing: whether another one looks like it.
  std::string instead(const JsonValue &of, const std::string &key) const {
    std::vector<std::string> names;
    for (const JsonMember &m : of.members) names.push_back(m.name);
    const std::string near = nearest(key, names);
    return near.empty() ? "" : "; there is \"" + near + "\"";
  }

  const JsonValue &input(const std::string &key, const std::string &what) const {
    const JsonValue *v = input_->find(key);
    if (!v) refuse("/input/" + key, "is missing, expected " + what + instead(*input_, key));
    return *v;
  }
  double needed(const std::string &key) const {
    return number_at(input(key, "a number for input.kind \"" + input_->get("kind") + "\""), "/input/" + key);
  }

  double positive(const char *key, bool wanted) const {
    const JsonValue *v = root_.find(key);
    if (!v || v->kind == JsonValue::null) {
      if (wanted)
        refuse("/" + std::string(key),
               "is missing, expected what the force moves, in kg" + instead(root_, key));
      return 0;
    }
    const double x = number_at(*v, "/" + std::string(key));
    if (!(x > 0)) refuse("/" + std::string(key), "is " + v->text + ", expected a number above 0");
    return x;
  }

  void read_normal_force(FrictionCase &c) const {
    if (c.drive == Drive::loaded) {
      if (root_.find("normal_force"))
        refuse("/normal_force",
               "is given by /input/F0 for input.kind \"" + c.kind + "\"; remove one of them");
      return;
    }
    c.normal_force = positive("normal_force", false);
    if (c.normal_force > 0 && c.gravity > 0)
      refuse("/normal_force", "and /gravity both give the normal force; remove one of them");
    const bool given = c.normal_force > 0 || (c.mass > 0 && c.gravity > 0);
    for (const CaseParam &p : c.params)
      if (!given && (p.key == "mu" || p.key.rfind("mu_", 0) == 0))
        return warn(file_ + ": /params/" + p.key +
                    " is a coefficient, and no normal force is given, so it is 1 N; give \"normal_force\" in "
                    "N, or \"mass\" and \"gravity\"");
  }

  // A number that nothing reads, as a normal force under another name, would give wrong forces in silence.
  void warn_of_keys(const DriveForm &form) const {
    std::vector<std::string> numbers = {"kind", "T", "dt", "form", "tag", "cycles"};
    numbers.insert(numbers.end(), form.needed.begin(), form.needed.end());
    numbers.insert(numbers.end(), form.optional.begin(), form.optional.end());
    const std::string kind = input_->get("kind");
    if (kind == "displacement_path") numbers.insert(numbers.end(), {"path", "x", "segment", "v_q"});
    if (kind == "force_ramps") numbers.push_back("rates");
    if (kind == "sine_velocity_sine_load") numbers.push_back("a");
    warn_of_keys_in(root_, "/", kKeys, "");
    warn_of_keys_in(*input_, "/input/", numbers, " for input.kind \"" + kind + "\"");
  }
  void warn_of_keys_in(const JsonValue &of, const std::string &pointer, const std::vector<std::string> &known,
                       const std::string &where) const {
    for (const JsonMember &m : of.members) {
      if (std::ranges::find(known, m.name) != known.end()) continue;
      warn(file_ + ": " + pointer + m.name + " is not read" + where +
           (m.name == "F0" || m.name.find("normal") != std::string::npos
                ? "; the normal force is /normal_force"
                : did_you_mean(m.name, known)));
    }
  }

  void read_kind(FrictionCase &c) {
    input_ = root_.find("input");
    if (!input_ || input_->kind != JsonValue::object)
      refuse("/input", "is missing, expected an object with kind and the numbers of the drive");
    c.kind = input_->get("kind");
    std::vector<std::string> kinds;
    for (const DriveForm &form : kDrives) kinds.push_back(form.kind);
    if (c.kind == "table")
      refuse("/input/kind",
             "is \"table\": values to compare functions with, not a run; there is nothing to simulate");
    const auto found = std::ranges::find(kinds, c.kind);
    if (found == kinds.end()) {
      std::string all;
      for (const std::string &k : kinds) all += (all.empty() ? "" : ", ") + k;
      refuse("/input/kind", (c.kind.empty() ? "is missing" : "is \"" + c.kind + "\"") + ", expected one of " +
                                all + did_you_mean(c.kind, kinds));
    }
    c.drive = Drive(found - kinds.begin());
  }

  void read_params(FrictionCase &c) const {
    const JsonValue *params = root_.find("params");
    if (!params || params->kind != JsonValue::object)
      refuse("/params", "is missing, expected an object with the law's parameters");
    for (const auto &[key, value] : params->members) {
      if (value.kind == JsonValue::null) continue;
      const std::string pointer = "/params/" + key;
      CaseParam p{key, {}, ""};
      if (value.kind == JsonValue::string) p.word = value.text;
      else if (value.kind == JsonValue::array) p.value = numbers_at(value, pointer);
      else p.value = {number_at(value, pointer)};
      c.params.push_back(p);
    }
  }

  // The only load case that the laws compute is the one that is projected on the cone (doc/laws/formulas.md
  // (7)).
  void refuse_other_loads(const FrictionCase &c) const {
    if (c.drive != Drive::loaded) return;
    const std::string form = input_->get("form");
    bool excess = false;
    for (const JsonValue &column : root_.list("columns"))
      excess |= column.get("name") == "cone_excess" || column.text == "cone_excess";
    if (excess || (!form.empty() && form.find("a_open") == std::string::npos))
      refuse("/input",
             "asks for a normal force without projection on the friction cone; only the projected form, Fn = "
             "F0(1 + a_open sin), runs");
  }

  void read_initial(FrictionCase &c) const {
    const JsonValue *initial = root_.find("initial");
    if (!initial) return;
    if (initial->kind != JsonValue::object) refuse("/initial", "is not an object, expected x, v and z");
    const auto one = [&](const char *key, double &to) {
      if (const JsonValue *v = initial->find(key)) to = number_at(*v, std::string("/initial/") + key);
    };
    one("x", c.x0);
    one("v", c.v0);
    one("z", c.z0[0]);
    one("zx", c.z0[0]);
    one("zy", c.z0[1]);
  }

  // The key of the case or, as in the reference set, of its input.
  const JsonValue *time_key(const char *key) const {
    const JsonValue *v = root_.find(key);
    return v ? v : input_->find(key);
  }
  void read_times(FrictionCase &c) const {
    if (const JsonValue *times = root_.find("output_times")) {
      c.times = numbers_at(*times, "/output_times");
    } else if (time_key("T") && time_key("dt")) {
      const double last = number_at(*time_key("T"), "/T"), dt = number_at(*time_key("dt"), "/dt");
      if (!(last >= 0)) refuse("/T", "is " + number(last) + " s, expected an end at 0 or later");
      if (!(dt > 0) || !(last / dt < 1e7))
        refuse("/dt", "is not a time between rows, expected T/dt below 1e7");
      for (int i = 0; i <= int(last / dt * (1 + 1e-9)); ++i) c.times.push_back(i * dt);
    } else {
      refuse("/output_times",
             "is missing, expected the times of the rows in s, or T and dt" + instead(root_, "output_times"));
    }
    for (size_t i = 0; i < c.times.size(); ++i)
      if (!(c.times[i] >= (i ? c.times[i - 1] : 0.0)) || (i && c.times[i] == c.times[i - 1]))
        refuse("/output_times/" + std::to_string(i),
               "is " + number(c.times[i]) + " s, expected times that rise from 0");
  }

  void read_path(FrictionCase &c) const {
    const JsonValue *x = input_->find("x"), *segment = input_->find("segment");
    if (x) {
      c.path_x = numbers_at(*x, "/input/x");
      c.path_segment =
          segment ? numbers_at(*segment, "/input/segment") : std::vector<double>(c.path_x.size(), 0.0);
      if (c.path_segment.size() != c.path_x.size())
        refuse("/input/segment", "has " + std::to_string(c.path_segment.size()) +
                                     " numbers, expected one for each of the " +
                                     std::to_string(c.path_x.size()) + " of x");
    } else {
      const std::vector<double> corner =
          numbers_at(input("path", "the corners of the path in m, or x"), "/input/path");
      c.path_x = {corner[0]};
      c.path_segment = {0};
      for (size_t i = 1; i < corner.size(); ++i)
        for (int k = 1; k <= kPathRows; ++k) {
          c.path_x.push_back(corner[i - 1] + (corner[i] - corner[i - 1]) * k / kPathRows);
          c.path_segment.push_back(double(i - 1));
        }
    }
    c.path_speed = kPathSpeed;
    for (const JsonValue *v : {root_.find("v_q"), input_->find("v_q")})
      if (v) c.path_speed = number_at(*v, "/v_q");
    if (!(c.path_speed > 0)) refuse("/v_q", "is not above 0, expected the speed along the path in m/s");
  }

  void read_columns(FrictionCase &c, const DriveForm &form) const {
    const JsonValue *columns = root_.find("columns");
    c.columns = form.columns;
    // a path's file lists the columns of several laws: ours has one F
    if (!columns || c.drive == Drive::path) return;
    if (columns->kind != JsonValue::array || columns->items.empty())
      refuse("/columns", "is not a list, expected names or objects with a name");
    c.columns.clear();
    for (const JsonValue &column : columns->items)
      c.columns.push_back(column.kind == JsonValue::object ? column.get("name") : column.text);
  }

  std::string file_, text_;
  JsonValue root_;
  const JsonValue *input_ = nullptr;
};

}  // namespace

const CaseParam *FrictionCase::param(const std::string &key) const {
  for (const CaseParam &p : params)
    if (p.key == key) return &p;
  return nullptr;
}

double FrictionCase::number_of(const std::string &key, double otherwise) const {
  const CaseParam *p = param(key);
  return p && p->value.size() == 1 ? p->value[0] : otherwise;
}

FrictionCase read_case(const std::string &file) { return CaseReader(file).read(); }

}  // namespace cli
