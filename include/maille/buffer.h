#pragma once

#include <maille/standard.h>

#include <algorithm>
#include <cstddef>
#include <initializer_list>
#include <memory>
#include <span>
#include <type_traits>
#include <utility>
#include <vector>

namespace maille {

/// The numbers of an array or of a block of cells: a vector, or memory of somebody else that is read where it
/// lies, such as arrays of numpy or VTK. Copies of what is borrowed borrow the same memory; whoever asks for
/// it to change (any member that is not const) gets a copy of his own first. The functions are those of
/// std::vector.
template <class T>
class Buffer {
 public:
  using value_type = T;
  using size_type = size_t;
  using difference_type = ptrdiff_t;
  using reference = T&;
  using const_reference = const T&;
  using pointer = T*;
  using const_pointer = const T*;
  using iterator = T*;
  using const_iterator = const T*;

  Buffer() = default;
  Buffer(std::vector<T> values) : own_(std::move(values)) { look(); }
  Buffer(std::initializer_list<T> values) : own_(values) { look(); }
  explicit Buffer(size_t count) : own_(count) { look(); }
  Buffer(size_t count, T value) : own_(count, value) { look(); }
  template <class Iterator>
  requires(!std::is_arithmetic_v<Iterator>) Buffer(Iterator first, Iterator last) : own_(first, last) {
    look();
  }
  /// Numbers that stay where they are. `owner` is kept as long as this buffer or a copy of it borrows them;
  /// without one the caller sees to it that they live so long. They must not change meanwhile, and lie as
  /// the type needs it (Array::bytes: as the type of the array needs it).
  static Buffer borrow(std::span<const T> values, std::shared_ptr<const void> owner = {}) {
    Buffer buffer;
    buffer.data_ = const_cast<T*>(values.data());  // written to only behind detach()
    buffer.size_ = values.size();
    buffer.owner_ = std::move(owner);
    return buffer;
  }

  Buffer(const Buffer& other) : own_(other.own_), owner_(other.owner_) { follow(other); }
  Buffer(Buffer&& other) noexcept : own_(std::move(other.own_)), owner_(std::move(other.owner_)) {
    data_ = std::exchange(other.data_, nullptr);
    size_ = std::exchange(other.size_, 0);
    other.own_.clear();
  }
  Buffer& operator=(const Buffer& other) {
    if (this == &other) return *this;
    own_ = other.own_;
    owner_ = other.owner_;
    follow(other);
    return *this;
  }
  Buffer& operator=(Buffer&& other) noexcept {
    Buffer moved(std::move(other));
    swap(moved);
    return *this;
  }
  ~Buffer() = default;
  void swap(Buffer& other) noexcept {
    own_.swap(other.own_);
    owner_.swap(other.owner_);
    std::swap(data_, other.data_);
    std::swap(size_, other.size_);
  }

  bool is_borrowed() const { return data_ != own_.data(); }
  /// A vector of the numbers; of an rvalue its own where it has one, without copying.
  std::vector<T> vector() const& { return std::vector<T>(begin(), end()); }
  std::vector<T> vector() && {
    detach();
    data_ = nullptr;
    size_ = 0;
    return std::move(own_);
  }

  size_t size() const { return size_; }
  bool empty() const { return size_ == 0; }
  size_t capacity() const { return is_borrowed() ? size_ : own_.capacity(); }
  const T* data() const { return data_; }
  const T* begin() const { return data_; }
  const T* end() const { return data_ + size_; }
  const T* cbegin() const { return data_; }
  const T* cend() const { return data_ + size_; }
  const T& operator[](size_t i) const { return data_[i]; }
  const T& front() const { return data_[0]; }
  const T& back() const { return data_[size_ - 1]; }

  T* data() {
    detach();
    return data_;
  }
  T* begin() { return data(); }
  T* end() { return data() + size_; }
  T& operator[](size_t i) { return data()[i]; }
  T& front() { return data()[0]; }
  T& back() { return data()[size_ - 1]; }

  void reserve(size_t count) {
    edit([&](std::vector<T>& own) { own.reserve(count); });
  }
  void resize(size_t count) {
    edit([&](std::vector<T>& own) { own.resize(count); });
  }
  void resize(size_t count, T value) {
    edit([&](std::vector<T>& own) { own.resize(count, value); });
  }
  void push_back(T value) {
    edit([&](std::vector<T>& own) { own.push_back(value); });
  }
  template <class... Arguments>
  T& emplace_back(Arguments&&... arguments) {
    edit([&](std::vector<T>& own) { own.emplace_back(std::forward<Arguments>(arguments)...); });
    return data_[size_ - 1];
  }
  void pop_back() {
    edit([&](std::vector<T>& own) { own.pop_back(); });
  }
  void shrink_to_fit() {
    edit([&](std::vector<T>& own) { own.shrink_to_fit(); });
  }
  void clear() {
    own_.clear();
    look();
  }
  void assign(size_t count, T value) {
    own_.assign(count, value);
    look();
  }
  template <class Iterator>
  requires(!std::is_arithmetic_v<Iterator>) void assign(Iterator first, Iterator last) {
    own_.assign(first, last);
    look();
  }
  void assign(std::initializer_list<T> values) { assign(values.begin(), values.end()); }
  template <class Iterator>
  requires(!std::is_arithmetic_v<Iterator>) T* insert(const T* at, Iterator first, Iterator last) {
    const auto place = at - data_;
    edit([&](std::vector<T>& own) { own.insert(own.begin() + place, first, last); });
    return data_ + place;
  }
  T* insert(const T* at, size_t count, T value) {
    const auto place = at - data_;
    edit([&](std::vector<T>& own) { own.insert(own.begin() + place, count, value); });
    return data_ + place;
  }
  T* insert(const T* at, std::initializer_list<T> values) { return insert(at, values.begin(), values.end()); }
  T* insert(const T* at, T value) { return insert(at, size_t{1}, value); }
  T* erase(const T* first, const T* last) {
    const auto place = first - data_;
    const auto count = last - first;
    edit([&](std::vector<T>& own) { own.erase(own.begin() + place, own.begin() + place + count); });
    return data_ + place;
  }

  friend bool operator==(const Buffer& a, const Buffer& b) {
    return std::equal(a.begin(), a.end(), b.begin(), b.end());
  }

 private:
  // Readers go by these two alone, as fast as in a vector: those of `own_`, or of what is borrowed.
  T* data_ = nullptr;
  size_t size_ = 0;
  std::vector<T> own_;  ///< empty while it borrows
  std::shared_ptr<const void> owner_;

  void look() {
    data_ = own_.data();
    size_ = own_.size();
    owner_.reset();
  }
  void follow(const Buffer& other) {
    const bool borrows = other.is_borrowed();
    data_ = borrows ? other.data_ : own_.data();
    size_ = other.size_;
  }
  void detach() {
    if (is_borrowed()) {
      own_.assign(data_, data_ + size_);
      look();
    }
  }
  template <class Change>
  void edit(const Change& change) {
    detach();
    change(own_);
    data_ = own_.data();
    size_ = own_.size();
  }
};

}  // namespace maille
