// A vector whose copies share their elements until one of them is changed.
#ifndef VANTAGE_CORE_PLANNING_PLAN_COPY_ON_WRITE_VECTOR_H_
#define VANTAGE_CORE_PLANNING_PLAN_COPY_ON_WRITE_VECTOR_H_

#include <algorithm>
#include <atomic>
#include <cstddef>
#include <memory>
#include <span>
#include <utility>
#include <vector>

namespace vantage::planning {

// A value like std::vector: no change shows in another copy. Copying takes no memory; the first
// change of elements that are shared copies them. Different copies may be used on different
// threads.
template <typename T>
class CopyOnWriteVector {
 public:
  using value_type = T;
  using size_type = size_t;
  using const_iterator = const T*;
  using iterator = const_iterator;

  CopyOnWriteVector() = default;
  CopyOnWriteVector(std::vector<T> elements)  // NOLINT: the same thing, that can be shared
      : elements_(std::make_shared<std::vector<T>>(std::move(elements))) {
    Look();
  }
  CopyOnWriteVector(const CopyOnWriteVector&) = default;
  CopyOnWriteVector& operator=(const CopyOnWriteVector&) = default;
  CopyOnWriteVector(CopyOnWriteVector&& other) noexcept { swap(other); }
  CopyOnWriteVector& operator=(CopyOnWriteVector&& other) noexcept {
    CopyOnWriteVector moved(std::move(other));
    swap(moved);
    return *this;
  }
  ~CopyOnWriteVector() = default;

  void swap(CopyOnWriteVector& other) noexcept {
    elements_.swap(other.elements_);
    std::swap(data_, other.data_);
    std::swap(size_, other.size_);
  }

  size_t size() const { return size_; }
  bool empty() const { return size_ == 0; }
  const T* data() const { return data_; }
  const T& operator[](size_t i) const { return data_[i]; }
  const T& front() const { return data_[0]; }
  const T& back() const { return data_[size_ - 1]; }
  const_iterator begin() const { return data_; }
  const_iterator end() const { return data_ + size_; }

  // The elements to change, until the next call of a member that is not const.
  std::span<T> Mutable() { return Own(); }
  void push_back(const T& element) {
    Own().push_back(element);
    Look();
  }
  void reserve(size_t size) {
    Own().reserve(size);
    Look();
  }
  void resize(size_t size, const T& with = T()) {
    Own().resize(size, with);
    Look();
  }

  bool operator==(const CopyOnWriteVector& other) const {
    return std::equal(begin(), end(), other.begin(), other.end());
  }

 private:
  std::vector<T>& Own() {
    if (elements_ == nullptr) {
      elements_ = std::make_shared<std::vector<T>>();
    } else if (elements_.use_count() > 1) {
      elements_ = std::make_shared<std::vector<T>>(*elements_);
    } else {
      // Whoever shared them last has read them before.
      std::atomic_thread_fence(std::memory_order_acquire);
    }
    Look();
    return *elements_;
  }
  void Look() {
    data_ = elements_->data();
    size_ = elements_->size();
  }

  std::shared_ptr<std::vector<T>> elements_;  // null: none
  // Of the elements: one look-up less for whoever reads them.
  const T* data_ = nullptr;
  size_t size_ = 0;
};

}  // namespace vantage::planning

#endif  // VANTAGE_CORE_PLANNING_PLAN_COPY_ON_WRITE_VECTOR_H_
