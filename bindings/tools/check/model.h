// A model under test: bodies of tetrahedra for it, what it answers at a state, and steps.
#pragma once
#include <cstdint>
#include <new>
#include <span>
#include <string>
#include <vector>

#include "check/environment.h"
#include "check/law.h"
#include "check/plugin.h"
#include "check/runner.h"

namespace cli::check {

template <class T>
struct Aligned64 {
  using value_type = T;
  Aligned64() = default;
  template <class U>
  Aligned64(const Aligned64<U> &) {}
  T *allocate(size_t n) { return static_cast<T *>(::operator new(n * sizeof(T), std::align_val_t(64))); }
  void deallocate(T *p, size_t) { ::operator delete(p, std::align_val_t(64)); }
  bool operator==(const Aligned64 &) const { return true; }
};
using Numbers = std::vector<double, Aligned64<double>>;

// Tetrahedra of a block of cubes with edges of `kCube`, its points shifted at random. Surfels are some of its
// points, and as many blends of three.
constexpr double kCube = 0.1;  // m
enum class Held { nothing, one_side };
struct Solid {
  uint32_t cell = DFM_CELL_TET;
  std::vector<double> rest, mass, weight;
  std::vector<uint32_t> cells, edges, row, col;
  std::vector<uint8_t> fixed;
  uint32_t npoint() const { return static_cast<uint32_t>(mass.size()); }
  uint32_t nodes() const;
  uint32_t ncell() const { return static_cast<uint32_t>(cells.size() / nodes()); }
  uint32_t nedge() const { return static_cast<uint32_t>(edges.size() / 2); }
  uint32_t nsurfel() const { return static_cast<uint32_t>(row.size() - 1); }
  double volume(uint32_t c) const;
  void find_properties(Held held);  // masses, held points and edges, of points and cells
  void find_edges();
};
Solid block(uint32_t x, uint32_t y, uint32_t z, Held held = Held::nothing);
// The same block of other cells: cubes, or cells of second order whose edges are straight.
Solid with_cells(const Solid &tetrahedra, uint32_t cell);
// 48 points: arrays of 64-byte lines at every stride. For cells of second order, which have points at their
// middles too, half as thick; still more cells than a SIMD register has lanes.
Solid small_block(uint32_t cell = DFM_CELL_TET, Held held = Held::nothing);

// Parameters with which rules are checked: the defaults, the defaults with damping, each word of each
// enumeration, and the first two with the other kinds of cells that the model takes. What create refuses is
// left out.
struct Variant {
  std::string name;  // "the defaults", "energy = stvk"
  std::vector<double> params;
  uint32_t cell;
};
bool takes_solids(const Subject &subject);  // of some kind of cells
// With the first kind of cells that the model takes.
Variant defaults_of(const Subject &subject);
std::vector<Variant> variants(const Subject &subject);

const dfm_model &model_of(const Subject &subject);

// What the host has of a body between two steps.
struct Moment {
  Numbers x, v;
  std::vector<double> state;
  double t = 0;
};

class Body : public Moment {
 public:
  // Where create refuses: Broken, or made() is false.
  enum class Refusal { is_broken, is_reported };
  Body(const Subject &subject, const Solid &solid, const Variant &variant, uint32_t stride = 4,
       Refusal refusal = Refusal::is_broken);
  ~Body();
  Body(const Body &) = delete;
  Body &operator=(const Body &) = delete;

  // why() is what create logged.
  bool made() const { return self != nullptr; }
  const std::string &why() const { return why_; }
  bool steps_itself() const { return stepper != nullptr; }
  bool can(uint32_t cap) const { return (caps & cap) != 0; }
  const void *extension(const char *id) const;
  uint32_t points() const { return solid.npoint(); }
  std::vector<uint32_t> surfels() const;  // all
  void take(const Moment &m) { Moment::operator=(m); }
  double *at(Numbers &of, uint32_t point) const { return of.data() + size_t(stride) * point; }

  dfm_kin kin() const;
  // The status of a call, under Kept and with the scratch given back.
  template <class F>
  dfm_status call(const char *name, F &&f) const {
    const Kept kept(name);
    const dfm_status status = f();
    subject.plugin->host().release_scratch();
    return status;
  }
  // The same, and Broken where it is not DFM_OK.
  template <class F>
  void must(const char *name, F &&f) const {
    if (const dfm_status status = call(name, f); status != DFM_OK) refused(name, status);
  }
  Numbers forces() const;                                   // [npoint,stride]
  double energy() const;                                    // J
  std::vector<double> stiffness(double a, double b) const;  // [3 npoint, 3 npoint]
  // In every row h^2 ksum + 2 h csum <= 4 m holds for the step h that the host allows; 0: no row needs it.
  double longest_step() const;
  void shake(double amount, double speed, Random &random);
  void turn(const double *axis, double angle, const double *shift);

  std::vector<double> predict(const Numbers &load);
  std::vector<double> respond(const std::vector<uint32_t> &surfels, const std::vector<double> &p) const;
  // p [nsurfel,3]; the state at t + dt becomes the state.
  void commit(const std::vector<double> &p);
  // One step without loads: of its own, or of symplectic Euler.
  void advance(double h);

  const Subject &subject;
  const Solid solid;
  const std::vector<double> params;
  const dfm_model &ops;
  const uint32_t stride;
  uint32_t caps = 0;  // of the model, less what the parameters take away
  void *self = nullptr;
  const dfm_stepper *stepper = nullptr;
  double dt = 1e-3;

 private:
  [[noreturn]] void refused(const char *name, dfm_status status) const;
  std::string why_;
};

std::string with(const Variant &variant);
double length(const double *a);
double largest(std::span<const double> f);
double most_apart(std::span<const double> a, std::span<const double> b);
// Does Cholesky's factorization of shift I - m, [width,width], exist? Only half of m is read.
bool below(const std::vector<double> &m, size_t width, double shift);

// Checks a rule for each variant, with which its sentences begin; the result of a rule that all of them keep.
template <class F>
std::string for_variants(const Subject &subject, const F &rule) {
  const std::vector<Variant> all = variants(subject);
  for (const Variant &v : all) {
    stage("%s", with(v).c_str());
    try {
      rule(v);
    } catch (const Broken &e) {
      throw Broken(with(v) + ", " + e.what());
    }
  }
  return text("%zu set%s of parameters", all.size(), all.size() == 1 ? "" : "s");
}

}  // namespace cli::check
