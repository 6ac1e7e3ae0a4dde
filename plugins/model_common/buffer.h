// Memory of a model: all of it comes from the host's allocator.
#pragma once
#include <deform/plugin.h>

#include <cstddef>
#include <cstring>
#include <new>
#include <utility>

namespace model {

// Array in the host's memory; cleared on creation.
template <class T>
class Buffer {
 public:
  Buffer() = default;
  Buffer(Buffer &&other) noexcept { swap(other); }
  Buffer &operator=(Buffer &&other) noexcept {
    swap(other);
    return *this;
  }
  ~Buffer() { drop(); }
  void drop() {
    if (data_) host_->release(host_->ctx, data_, size_ * sizeof(T), 64);
    data_ = nullptr;
  }
  void create(const dfm_host *host, size_t n) {
    create_raw(host, n);
    std::memset(static_cast<void *>(data_), 0, size_ * sizeof(T));
  }
  void create_copy(const dfm_host *host, const T *from, size_t n) {
    create(host, n);
    if (n) std::memcpy(data_, from, n * sizeof(T));
  }
  // Not cleared.
  void create_raw(const dfm_host *host, size_t n) {
    drop();
    host_ = host;
    size_ = n ? n : 1;
    data_ = static_cast<T *>(host->alloc(host->ctx, size_ * sizeof(T), 64));
    if (!data_) throw std::bad_alloc();
  }
  void swap(Buffer &other) {
    std::swap(host_, other.host_);
    std::swap(data_, other.data_);
    std::swap(size_, other.size_);
  }
  bool empty() const { return !data_; }
  T *data() { return data_; }
  const T *data() const { return data_; }
  T &operator[](size_t i) { return data_[i]; }
  const T &operator[](size_t i) const { return data_[i]; }

 private:
  const dfm_host *host_ = nullptr;
  T *data_ = nullptr;
  size_t size_ = 0;
};

}  // namespace model
