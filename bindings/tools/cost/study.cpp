// How the budget is spent:
//
//   slices     every choice, each for a short time          -> done, or stopped: how long it would take
//   reference  the finest pair of a ladder that fits        -> the two finest runs, and their distance
//   the rest   by rising predicted time                     -> errors against the reference
//   alone      members of the front, one after the other    -> processor times that nothing disturbs
#include "study.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <limits>

#include "messages.h"
#include "plane.h"

namespace cli::cost {
namespace {

constexpr const char *kExplicit = "symplectic_euler";
constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
// Shares of the budget: all slices, on the processors together; the reference, of what slices leave; the
// scene as it is.
constexpr double kSliceShare = 0.15, kReferenceShare = 0.6, kOwnShare = 0.4;
// Share of the budget: processor time that a run of the reference may take to its first record.
constexpr double kKnowShare = 0.2;
// Shares of the budget: when no more slices are begun, on a machine that has others to serve, and no more of
// those.
constexpr double kSlicesEnd = 0.35, kKnownEnd = 0.45;
constexpr double kAloneShare = 0.15;  // of the budget: the front once more, alone and with pictures
constexpr double kPictureTime = 0.5;  // s that pictures may take beside a run
constexpr size_t kPictures = 6;
// Beyond four times the scene's cells: 16 and 64 times, up to so many.
constexpr struct { double times, most; } kBeyond[] = {{64, 4000}, {16, 40000}};

class Student {
 public:
  Student(const Subject &subject, Runs &runs, Study &study) : s_(subject), runs_(runs), out_(study) {}

  void study() {
    for (const Candidate &c : out_.axes.candidates) add(c);
    make_ladder();
    slices();
    choose_pair();
    run_rest();
    find_next();
    if (out_.reference < 0) fall_back();
    compare();
    compare_on_this_mesh();
    separate();
    find_fronts();
    choose();
    time_alone();
    find_fronts();
    choose();
    find_next();  // what this call has spent since is missing in the next one
    out_.started = runs_.started();
    out_.used = out_.options.budget - runs_.left();
  }

 private:
  // s of processor time for a simulated one; of a static scene for all of it
  double cost_of(const Outcome &o) const { return s_.at_rest ? o.cpu : o.cpu_per_s(); }
  double predicted(int row) const { return out_.rows[size_t(row)].job.outcome.predicted(s_.duration); }
  // s; who had no slice comes after those of whom something is known
  double wait_for(int row) const {
    const bool unknown = out_.rows[size_t(row)].job.outcome.state == Outcome::none;
    return unknown ? std::numeric_limits<double>::infinity() : predicted(row);
  }
  bool done(int row) const { return row >= 0 && out_.rows[size_t(row)].job.outcome.state == Outcome::done; }

  int add(const Candidate &candidate) {
    for (size_t i = 0; i < out_.rows.size(); ++i)
      if (out_.rows[i].candidate.knobs == candidate.knobs) {
        auto &axes = out_.rows[i].candidate.axes;
        for (const std::string &axis : candidate.axes)
          if (std::ranges::find(axes, axis) == axes.end()) axes.push_back(axis);
        return int(i);
      }
    Row row;
    row.candidate = candidate;
    row.job.label = label_of(candidate.knobs);
    row.job.set = settings_of(s_, candidate.knobs);
    for (auto &setting : observe()) row.job.set.push_back(std::move(setting));
    runs_.prepare(row.job);
    out_.rows.push_back(std::move(row));
    return int(out_.rows.size()) - 1;
  }

  // What every run records, whatever the scene writes otherwise.
  Settings observe() const {
    Settings out = {{"/output/every", number(std::min(s_.every, s_.duration / 100))},
                    {"/output/states", "false"},
                    {"/output/nodes", "false"},
                    {"/output/contacts", "true"},
                    {"/output/check", "false"},
                    {"/output/frames", "false"}};
    if (s_.probes) return out;
    std::vector<std::string> probes;
    for (const SubjectBody &body : s_.bodies)
      for (size_t k = 0; k < body.ends.size(); ++k) {
        JsonObject probe;
        const std::string end = "_end" + std::to_string(k + 1), name = body.name + end;
        // a name of the length that a name may have leaves no room
        probe.add("name", quoted(name.size() > 100 ? std::to_string(&body - s_.bodies.data()) + end : name),
                  "body", quoted(body.name), "point", json_vector(body.ends[k].data()));
        probes.push_back(probe.text());
      }
    out.emplace_back("/probes", json_array(probes));
    return out;
  }

  // Pairs from the finest down: a run and the one that it is checked against, coarser in all that varies.
  void make_ladder() {
    Knobs k;
    k.model = out_.axes.reference_model;
    const auto row = [&](double cells, const std::string &integrator, const std::string &step) {
      k.cells = cells;
      k.integrator = integrator;
      k.step = step;
      return add({k, {"reference"}});
    };
    const std::string own, automatic = "\"auto\"", explicit_time = kExplicit;
    const std::string integrator = out_.axes.steps ? explicit_time : own;
    const std::string step = out_.axes.steps ? automatic : own;
    // all of one kind; the scene's own mesh may be of another one
    const auto pairs_of = [&](double unit, std::initializer_list<double> times) {
      for (const double *t = times.begin(); t + 1 < times.end(); ++t) {
        const int fine = row(unit * t[0], integrator, step);
        ladder_.emplace_back(fine, row(unit * t[1], integrator, step));
      }
    };
    const auto beyond = [&](double unit) {  // what a small scene affords
      double cells = 0;
      for (const SubjectBody &body : s_.bodies) cells += unit * body.cells;
      for (const auto &[times, most] : kBeyond)
        if (times * cells <= most) pairs_of(unit, {times, times / 4});
    };
    if (out_.axes.meshes) {
      if (out_.axes.lattices) {
        k.kind = Cells::hexahedra;
        beyond(kHexahedron);
        pairs_of(kHexahedron, {4, 1, 1.0 / 4, 1.0 / 16});
        k.kind = Cells::own;
      }
      beyond(1);
      pairs_of(1, {4, 2, 0.5, 0.25, 0.125});
      if (out_.axes.steps && s_.stable > 0) {
        out_.own_mesh.reference = row(1, explicit_time, seconds(0.5 * s_.stable));
        out_.own_mesh.check = row(1, explicit_time, automatic);
      }
    } else if (out_.axes.steps && s_.stable > 0) {
      // no choice has shorter steps than the first
      const int quarter = row(1, explicit_time, seconds(0.25 * s_.explicit_step())),
                half = row(1, explicit_time, seconds(0.5 * s_.explicit_step())),
                stable_half = row(1, explicit_time, seconds(0.5 * s_.stable)),
                stable = row(1, explicit_time, automatic);
      ladder_ = {{quarter, half}, {stable_half, stable}};
    }
    if (out_.axes.steps) {
      const double h = std::min(1.0 / 200, s_.duration / 100);
      const int twice = row(1, "tr_bdf2", seconds(h / 2)),
                once = row(out_.axes.meshes ? 0.5 : 1, "tr_bdf2", seconds(h));
      ladder_.push_back({twice, once});
    }
  }

  std::vector<Job *> jobs_of(const std::vector<int> &rows, double limit) {
    std::vector<Job *> out;
    for (const int i : rows) {
      out_.rows[size_t(i)].job.limit = limit;
      out.push_back(&out_.rows[size_t(i)].job);
    }
    return out;
  }

  void slices() {
    std::vector<int> order;
    for (size_t i = 0; i < out_.rows.size(); ++i) order.push_back(int(i));
    // the ladder first: what it would take decides the rest
    std::stable_sort(order.begin() + 1, order.end(),
                     [&](int a, int b) { return on_ladder(a) > on_ladder(b); });
    const double each = kSliceShare * out_.options.budget * runs_.parallel() / double(order.size());
    runs_.expect(order.size());
    std::vector<Job *> jobs = jobs_of(order, std::numeric_limits<double>::max());
    for (Job *job : jobs) job->work = std::max(each, 0.3);
    jobs[0]->work = kOwnShare * out_.options.budget;  // the scene as it is: the least to be shown
    runs_.run(jobs, runs_.parallel(), (1 - kSlicesEnd) * out_.options.budget);
    know_ladder(std::max(each, 0.3));
    for (Job *job : jobs) job->work = std::numeric_limits<double>::max();
  }

  // The finest meshes may have been made in their slice and no more: without a first record it is unknown
  // what they would take, and the reference would be coarse for no reason.
  void know_ladder(double slice) {
    for (double work = 4 * slice; work <= kKnowShare * out_.options.budget; work *= 4) {
      std::vector<int> unknown;
      for (size_t i = 0; i < out_.rows.size(); ++i)
        if (on_ladder(int(i)) && !failed(int(i)) && std::isinf(predicted(int(i)))) unknown.push_back(int(i));
      if (unknown.empty()) return;
      std::vector<Job *> jobs = jobs_of(unknown, std::numeric_limits<double>::max());
      for (Job *job : jobs) job->work = work;
      runs_.run(jobs, runs_.parallel(), (1 - kKnownEnd) * out_.options.budget);
    }
  }

  // Whether the row computes the same scene in another way. Another law, self contact and guard are
  // other physics: what they change is shown, and they are not chosen.
  bool same_physics(int row) const {
    const Knobs &k = out_.rows[size_t(row)].candidate.knobs;
    return k.law.empty() && k.self.empty() && k.guard.empty();
  }

  int turn(int row) const { return on_ladder(row) ? 0 : same_physics(row) ? 1 : 2; }

  bool on_ladder(int row) const {
    return std::ranges::any_of(ladder_,
                               [&](const auto &pair) { return pair.first == row || pair.second == row; });
  }

  bool failed(int row) const {
    const Outcome::State state = out_.rows[size_t(row)].job.outcome.state;
    return state == Outcome::unstable || state == Outcome::refused || state == Outcome::none;
  }

  // Contacts of implicit time damp impacts: such a run would call the rebounds of explicit ones an error.
  bool damps_impacts(int row) const {
    const std::string &integrator = out_.rows[size_t(row)].candidate.knobs.integrator;
    const bool implicit = integrator.empty() ? s_.implicit : integrator != kExplicit;
    return implicit && s_.contact && out_.axes.steps;
  }

  // It is the reference only where explicit time is impossible, which no larger budget changes.
  bool hides_impacts(int row) const {
    if (!damps_impacts(row)) return false;
    return std::ranges::any_of(ladder_, [&](const auto &pair) {
      const Outcome &o = out_.rows[size_t(pair.first)].job.outcome;
      return !damps_impacts(pair.first) && o.state != Outcome::refused && o.state != Outcome::unstable;
    });
  }

  void choose_pair() {
    for (size_t i = 0; i < ladder_.size(); ++i) {
      const auto [fine, coarse] = ladder_[i];
      if (failed(fine) || failed(coarse) || hides_impacts(fine)) continue;
      const double most = kReferenceShare * runs_.left();
      if (s_.at_rest) runs_.run(jobs_of({fine, coarse}, most), runs_.parallel());
      const auto fits = [&](int row) { return done(row) || predicted(row) <= most; };
      if (!fits(fine) || !fits(coarse)) continue;
      out_.reference = fine;
      out_.check = coarse;
      if (i + 1 < ladder_.size() && ladder_[i + 1].first == coarse) out_.third = ladder_[i + 1].second;
      return;
    }
  }

  void run_rest() {
    std::vector<int> order;
    for (size_t i = 0; i < out_.rows.size(); ++i)
      if (int(i) != out_.reference && int(i) != out_.check && int(i) != out_.third &&
          (!on_ladder(int(i)) || i == 0 || out_.rows[i].candidate.axes.size() > 1))
        order.push_back(int(i));
    std::ranges::stable_sort(order, [&](int a, int b) {
      const int first = turn(a) / 2, second = turn(b) / 2;  // the ladder counts as the rest here
      return first != second ? first < second : wait_for(a) < wait_for(b);
    });
    // the scene's own mesh first: what is said of it is said in any case
    for (const int i : {out_.third, out_.check, out_.reference, out_.own_mesh.check, out_.own_mesh.reference})
      if (i >= 0) {
        std::erase(order, i);
        order.insert(order.begin(), i);
      }
    runs_.run(jobs_of(order, std::numeric_limits<double>::max()), runs_.parallel(),
              kAloneShare * out_.options.budget);
    if (out_.reference >= 0 && !done(out_.reference)) out_.reference = out_.check = -1;
    if (out_.check >= 0 && !done(out_.check)) out_.check = -1;
    if (!done(out_.third) || out_.check < 0) out_.third = -1;
  }

  // What a larger budget would bring: model and step on the scene's own mesh, or a finer reference. Both runs
  // of a pair go on at the same time where there are two processors.
  void find_next() {
    const double used = out_.options.budget - runs_.left();
    out_.next.clear();
    out_.next_budget = 0;
    const auto consider = [&](int fine, int coarse, double share, const std::string &what) {
      double need = 0;
      for (const int row : {fine, coarse}) {
        if (done(row)) continue;
        if (failed(row) || !std::isfinite(predicted(row))) return;
        need = runs_.parallel() > 1 ? std::max(need, predicted(row)) : need + predicted(row);
      }
      // the next call's slices come first; forecasts are no better than a tenth
      const double budget = 1.1 * (used + need / share) / (1 - kSliceShare);
      if (need <= 0 || (out_.next_budget > 0 && budget >= out_.next_budget)) return;
      out_.next = what;
      out_.next_budget = std::max(budget, 1.1 * out_.options.budget);
    };
    out_.finest = out_.check >= 0 && out_.reference == ladder_.front().first;
    const OnThisMesh &own = out_.own_mesh;
    if (own.reference >= 0)
      consider(own.reference, own.check, 1 - kAloneShare, "judge model and step on the scene's own mesh");
    for (const auto &[fine, coarse] : ladder_) {
      if (fine == out_.reference && out_.check >= 0) break;  // coarser ones say less
      if (hides_impacts(fine)) continue;
      consider(fine, coarse, kReferenceShare,
               "take \"" + out_.rows[size_t(fine)].job.label + "\" as the reference");
    }
  }

  // The longest run of the reference's model that came to its end is the best that there is, of those that
  // compute the same effects.
  void fall_back() {
    double most = -1;
    for (size_t i = 0; i < out_.rows.size(); ++i) {
      const Row &row = out_.rows[i];
      const Knobs &k = row.candidate.knobs;
      const bool physics = same_physics(int(i)) && k.volume.empty() && k.precision != "single" &&
                           k.tolerance.empty() && !hides_impacts(int(i));
      const double rank = row.job.outcome.cpu + (k.model == out_.axes.reference_model ? 1e9 : 0);
      if (!done(int(i)) || !physics || rank <= most) continue;
      most = rank;
      out_.reference = int(i);
    }
    if (out_.reference >= 0) return;
    const bool any =
        std::ranges::any_of(out_.rows, [](const Row &row) { return row.job.outcome.state == Outcome::done; });
    for (const Row &row : out_.rows)
      if (!any && (row.job.outcome.state == Outcome::unstable || row.job.outcome.state == Outcome::refused))
        throw Failure(kBadInput, s_.path + ": no run came to its end; \"" + row.job.label +
                                     "\": " + row.job.outcome.sentence);
    double least = out_.next_budget;
    if (!(least > 0)) {
      const double own = predicted(0);
      least = std::isfinite(own) ? own / kOwnShare : 10 * out_.options.budget;
    }
    throw Failure(
        kBadInput,
        s_.path +
            formatted(": no run%s came to its end within the budget of %.3g s; take --budget %.0f or more",
                      any ? " that can be the reference (explicit time, in which contacts rebound)" : "",
                      out_.options.budget, std::ceil(least)));
  }

  void compare() {
    figures_.resize(out_.rows.size());
    double size = 0;
    for (const SubjectBody &body : s_.bodies) size = std::max(size, body.size);
    for (size_t i = 0; i < out_.rows.size(); ++i) {
      Row &row = out_.rows[i];
      row.cpu_per_s = cost_of(row.job.outcome);
      row.compared = done(int(i));
      if (row.compared) figures_[i] = read_quantities(row.job.folder);
    }
    truth_ = figures_[size_t(out_.reference)];
    double last_record = 0;
    for (const auto &[name, q] : truth_)
      if (!q.t.empty()) last_record = std::max(last_record, q.t.back());
    for (const auto &[name, q] : truth_) {
      out_.quantities.push_back(name);
      out_.scales[name] = scale_of(q, 1e-3 * size, s_.duration);
      out_.units[name] = q.unit;
      if (q.family == "probe" && q.t.back() < last_record) out_.until[name] = q.t.back();
    }
    name_headline(truth_);
    find_limits();
    for (size_t i = 0; i < out_.rows.size(); ++i) {
      Row &row = out_.rows[i];
      row.headline = kNone;
      if (!row.compared) continue;
      row.error = errors(i, truth_);
      row.headline = largest(row.error);
    }
    for (const auto &[name, limit] : out_.limits) out_.reference_error[name] = limit.error;
    out_.reference_headline = largest(out_.reference_error);
    out_.best = std::numeric_limits<double>::infinity();
    for (size_t i = 0; i < out_.rows.size(); ++i)
      if (eligible(i)) out_.best = std::min(out_.best, out_.rows[i].headline);
    std::map<std::string, double> bounds;
    for (const auto &[name, limit] : out_.limits) bounds[name] = limit.bound;
    out_.reference_bound = largest(bounds);
    out_.converged = std::isfinite(out_.best) && out_.reference_bound <= out_.best / 3;
  }

  double size_of_cells(int row) const {
    const double cells = out_.rows[size_t(row)].job.outcome.cells;
    return cells > 0 ? std::cbrt(1 / cells) : 1;
  }

  // What the finest run, the one that it is checked by and a third one say about the limit; without a check
  // nothing is known.
  void find_limits() {
    if (out_.check < 0) return;
    const Quantities fine = truth_, &middle = figures_[size_t(out_.check)];
    const double h[3] = {size_of_cells(out_.reference), size_of_cells(out_.check),
                         out_.third >= 0 ? size_of_cells(out_.third) : 0};
    for (const auto &[name, q] : fine) {
      const auto second = middle.find(name);
      Limit limit;
      if (second == middle.end()) {
        limit.error = q.event ? 1.0 : kNone;
      } else {
        const Quantity *coarse = nullptr;
        if (out_.third >= 0) {
          const Quantities &third = figures_[size_t(out_.third)];
          if (const auto found = third.find(name); found != third.end()) coarse = &found->second;
        }
        limit = find_limit(q, second->second, coarse, h, out_.scales[name], truth_[name]);
        // a mesh that could not be made finer shows nothing of what its cells bring
        const auto cells = [&](int row) { return out_.rows[size_t(row)].candidate.knobs.cells; };
        if (limit.basis == Basis::same_mesh && cells(out_.reference) != cells(out_.check)) {
          limit.basis = Basis::two_meshes;
          limit.bound = std::numeric_limits<double>::infinity();
        }
        if (damps_impacts(out_.reference)) {
          limit.basis = Basis::damped;
          limit.bound = std::numeric_limits<double>::infinity();
        }
      }
      out_.limits[name] = limit;
    }
  }

  // Model and step on the scene's own mesh: whether that mesh is fine enough is another question.
  void compare_on_this_mesh() {
    OnThisMesh &own = out_.own_mesh;
    if (!done(own.reference) || !done(own.check)) {
      own.reference = own.check = -1;
      return;
    }
    own.mesh = out_.rows[size_t(own.reference)].headline;
    for (size_t i = 0; i < out_.rows.size(); ++i) {
      if (!out_.rows[i].compared || !out_.rows[i].candidate.knobs.own_mesh() || !same_physics(int(i)))
        continue;
      own.error[i] = largest(errors(i, figures_[size_t(own.reference)]));
    }
    own.own = own.error[size_t(own.check)];
  }

  // Quantities of at least this scale.
  std::string listed(double least) const {
    std::string all;
    for (const std::string &name : out_.quantities)
      if (out_.scales.at(name) >= least) all += (all.empty() ? "" : ", ") + name;
    return all;
  }

  void name_headline(const Quantities &truth) {
    std::vector<std::string> words = out_.options.quantities;
    if (words.empty()) words = {"probe"};
    for (const std::string &word : words) {
      const std::vector<std::string> names = named(truth, word);
      if (names.empty()) {
        throw Failure(kBadInput, "--quantity: there is no \"" + word + "\" in this scene, expected one of " +
                                     listed(0) + did_you_mean(word, out_.quantities));
      }
      for (const std::string &name : names)
        (out_.scales.at(name) > 0 ? out_.headline : out_.zeros).push_back(name);
    }
    if (out_.headline.empty())
      throw Failure(kBadInput, "--quantity: " + out_.zeros[0] +
                                   " is 0 in the reference, and no error is relative to that; name one of " +
                                   listed(std::numeric_limits<double>::min()));
  }

  // Errors of a row against another, by quantity.
  std::map<std::string, double> errors(size_t row, const Quantities &against) const {
    std::map<std::string, double> out;
    for (const auto &[name, q] : against) {
      const auto found = figures_[row].find(name);
      const auto scale = out_.scales.find(name);
      if (scale == out_.scales.end()) continue;
      // a pair that never touches has no rows: its events did not happen
      out[name] =
          found == figures_[row].end() ? (q.event ? 1.0 : kNone) : error_of(found->second, q, scale->second);
    }
    return out;
  }

  double largest(const std::map<std::string, double> &error) const {
    double most = 0;
    for (const std::string &name : out_.headline) {
      const auto found = error.find(name);
      if (found == error.end() || std::isnan(found->second)) return kNone;
      most = std::max(most, found->second);
    }
    return most;
  }

  bool eligible(size_t i) const {
    return out_.rows[i].compared && int(i) != out_.reference && int(i) != out_.check &&
           same_physics(int(i)) && std::isfinite(out_.rows[i].headline);
  }

  // Steps and cells have a finest choice of their own; of switches the scene as it is stands for it.
  size_t anchor_of(const std::string &axis) const {
    size_t best = 0;
    double most = -1;
    for (size_t i = 0; i < out_.rows.size(); ++i) {
      const Row &row = out_.rows[i];
      const auto &axes = row.candidate.axes;
      const bool member = i == 0 || std::ranges::find(axes, axis) != axes.end();
      if (!member || !row.compared) continue;
      const Knobs &k = row.candidate.knobs;
      double rank = i == 0 ? 0 : -1;
      if (axis == "time") rank = k.integrator == kExplicit ? row.job.outcome.steps : 0;
      else if (axis == "mesh") rank = row.job.outcome.cells;
      else if (axis == "model") rank = k.model == out_.axes.reference_model ? 1 : 0;
      else if (axis == "contact" && !k.tolerance.empty())
        rank = 1 / std::strtod(k.tolerance.c_str(), nullptr);
      if (rank <= most) continue;
      most = rank;
      best = i;
    }
    return best;
  }

  void separate() {
    for (const Axis &axis : out_.axes.axes) {
      if (!axis.left_out.empty()) continue;
      Separated part{axis.name, axis.kinds[0], anchor_of(axis.name), {}};
      if (!out_.rows[part.anchor].compared) continue;
      for (size_t i = 0; i < out_.rows.size(); ++i) {
        const auto &axes = out_.rows[i].candidate.axes;
        const bool member = i == 0 || std::ranges::find(axes, axis.name) != axes.end();
        if (member && out_.rows[i].compared)
          part.rows.emplace_back(i, largest(errors(i, figures_[part.anchor])));
      }
      if (part.rows.size() > 1) out_.separated.push_back(std::move(part));
    }
  }

  void find_fronts() {
    std::vector<size_t> all, here;
    for (size_t i = 0; i < out_.rows.size(); ++i)
      if (eligible(i)) all.push_back(i);
    OnThisMesh &own = out_.own_mesh;
    for (const auto &[i, error] : own.error)
      if (std::isfinite(error) && int(i) != own.reference) here.push_back(i);
    out_.front = front_of(std::move(all), [&](size_t i) { return out_.rows[i].headline; });
    own.front = front_of(std::move(here), [&](size_t i) { return own.error.at(i); });
  }

  template <class Error>
  std::vector<size_t> front_of(std::vector<size_t> order, Error error) const {
    std::ranges::stable_sort(
        order, [&](size_t a, size_t b) { return out_.rows[a].cpu_per_s < out_.rows[b].cpu_per_s; });
    std::vector<size_t> out;
    double least = std::numeric_limits<double>::infinity();
    for (const size_t i : order)
      if (error(i) < least) {
        least = error(i);
        out.push_back(i);
      }
    return out;
  }

  // The row once more, with two pictures, at its start and its end, where it is to be shown; not where the
  // budget does not hold it.
  void run_again(size_t i, bool picture) {
    Row &row = out_.rows[i];
    Job job;
    job.label = row.job.label;
    job.set = row.job.set;
    for (auto &[pointer, value] : job.set)
      if (picture && pointer == "/output/frames") value = number(1 / s_.duration);
    runs_.prepare(job, "alone");
    if (!job.outcome.final_state()) {
      if (row.job.outcome.took + (picture ? kPictureTime : 0) > runs_.left()) return;
      job.limit = runs_.left();
      runs_.run({&job}, 1);
    }
    if (job.outcome.state != Outcome::done) return;
    row.cpu_per_s = cost_of(job.outcome);
    row.alone = true;
    const std::string file = job.folder + "/frames/frame_000001.png";
    std::error_code error;
    if (std::filesystem::exists(file, error)) row.picture = file;
  }

  // The choice, the scene as it is and the reference are shown, then members of the front from its ends.
  void time_alone() {
    std::vector<size_t> order = {0, size_t(out_.reference)};
    if (out_.pick >= 0) order.insert(order.begin(), size_t(out_.pick));
    order.insert(order.end(), out_.own_mesh.front.begin(), out_.own_mesh.front.end());
    for (size_t k = 0; 2 * k < out_.front.size(); ++k) {
      order.push_back(out_.front[out_.front.size() - 1 - k]);
      order.push_back(out_.front[k]);
    }
    size_t shown = 0;
    for (const size_t i : order) {
      if (!out_.rows[i].compared || out_.rows[i].alone) continue;
      const bool picture = shown < kPictures;
      run_again(i, picture);
      shown += picture;
    }
  }

  // The cheapest within the target even if its error and the bound of the reference's add up (proven).
  // Where there is none: with the estimate of the reference's error, then if the two have nothing to do
  // with each other (likely). Where there is none either, and where the reference is farther off: the
  // cheapest that is so on the scene's own mesh.
  void choose() {
    const double target = out_.options.target, own = out_.reference_headline, bound = out_.reference_bound;
    const auto first = [&](auto &&good) {
      for (const size_t i : out_.front)
        if (good(out_.rows[i].headline)) return int(i);
      return -1;
    };
    out_.pick = first([&](double e) { return e + bound <= target; });
    out_.proven = out_.pick >= 0;
    if (out_.pick < 0) out_.pick = first([&](double e) { return e + own <= target; });
    if (out_.pick < 0) out_.pick = first([&](double e) { return plane_length(e, own) <= target; });
    OnThisMesh &here = out_.own_mesh;
    here.pick = -1;
    for (const size_t i : here.front)
      if (here.pick < 0 && here.error[i] + here.own <= target) here.pick = int(i);
    out_.mesh_stays = out_.pick < 0 && here.pick >= 0;
    if (out_.mesh_stays) out_.pick = here.pick;
  }

  const Subject &s_;
  Runs &runs_;
  Study &out_;
  std::vector<std::pair<int, int>> ladder_;
  std::vector<Quantities> figures_;  // by row
  Quantities truth_;                 // what all are compared with
};

}  // namespace

Study make_study(const Subject &subject, const std::string &mesh_left_out, const StudyOptions &options,
                 Runs &runs) {
  Study out;
  out.options = options;
  if (subject.at_rest) out.cost_unit = "s";
  out.axes = find_axes(subject, mesh_left_out, options.axes);
  Student(subject, runs, out).study();
  return out;
}

}  // namespace cli::cost
