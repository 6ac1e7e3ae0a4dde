// Pictures of a run that may have to be drawn once more, when the range of its values is known: what they
// show, in a file that has no name and goes with the process.
#pragma once
#include <cstdint>
#include <string>
#include <vector>

#include "file.h"
#include "render/render.h"

namespace cli {

struct KeptFrame {
  double t = 0;    // s
  double top = 0;  // the value that was drawn as 1
  render::Scene scene;
};

class KeptFrames {
 public:
  explicit KeptFrames(const std::string &folder);
  void add(const KeptFrame &frame);
  void rewind();
  // The frames in their order; what `out` points to lives here until the next call. False: there are no more.
  bool next(KeptFrame &out);
  // Multiplies the values of the frame that was read last.
  void rescale(float by);

 private:
  struct Arrays {
    std::vector<double> xyz;
    std::vector<uint32_t> tri;
    std::vector<float> scalar;
  };
  template <class T>
  void put(const T *from, size_t n);
  template <class T>
  void get(T *to, size_t n);
  template <class T>
  void put(const std::vector<T> &from);
  template <class T>
  void get(std::vector<T> &to);

  std::string path_;
  File file_;
  std::vector<Arrays> last_;  // of the last frame written or read
};

}  // namespace cli
