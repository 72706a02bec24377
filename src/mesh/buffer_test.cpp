#include <maille/buffer.h>

#include <gtest/gtest.h>

#include <memory>
#include <numeric>

namespace maille {
namespace {

using Numbers = Buffer<uint32_t>;

Numbers borrowed(const std::vector<uint32_t>& numbers) {
  return Numbers::borrow(numbers);
}

TEST(Buffer, ReadsWhatItBorrowsWhereItLies) {
  const std::vector<uint32_t> numbers{3, 1, 4};
  const Numbers buffer = borrowed(numbers);
  EXPECT_TRUE(buffer.is_borrowed());
  EXPECT_EQ(buffer.data(), numbers.data());
  EXPECT_EQ(buffer.size(), 3u);
  EXPECT_EQ(buffer[2], 4u);
  EXPECT_EQ(buffer, numbers);
}

TEST(Buffer, CopiesOfABorrowedOneBorrowTheSame) {
  const std::vector<uint32_t> numbers{3, 1, 4};
  const Numbers buffer = borrowed(numbers);
  const Numbers copy = buffer;
  Numbers assigned{7, 7};
  assigned = buffer;
  const Numbers moved = std::move(assigned);
  EXPECT_EQ(copy.data(), numbers.data());
  EXPECT_EQ(moved.data(), numbers.data());
  EXPECT_TRUE(assigned.empty());  // NOLINT: what was moved from is empty, by promise
}

TEST(Buffer, GetsACopyOfItsOwnBeforeItChanges) {
  const std::vector<uint32_t> numbers{3, 1, 4};
  const Numbers first = borrowed(numbers);
  const auto changed = [&](const auto& change) {
    Numbers copy = first;
    change(copy);
    EXPECT_FALSE(copy.is_borrowed());
    return copy.vector();
  };
  using List = std::vector<uint32_t>;
  EXPECT_EQ(changed([](Numbers& b) { b[1] = 9; }), (List{3, 9, 4}));
  EXPECT_EQ(changed([](Numbers& b) { b.push_back(1); }), (List{3, 1, 4, 1}));
  EXPECT_EQ(changed([](Numbers& b) { b.resize(2); }), (List{3, 1}));
  EXPECT_EQ(changed([](Numbers& b) { b.clear(); }), (List{}));
  EXPECT_EQ(changed([](Numbers& b) { b.assign(2, 8); }), (List{8, 8}));
  EXPECT_EQ(changed([](Numbers& b) { b.erase(b.begin(), b.begin() + 1); }), (List{1, 4}));
  EXPECT_EQ(changed([&](Numbers& b) { b.insert(b.end(), numbers.begin(), numbers.end()); }),
            (List{3, 1, 4, 3, 1, 4}));
  EXPECT_EQ(changed([](Numbers& b) { std::iota(b.begin(), b.end(), 5u); }), (List{5, 6, 7}));
  EXPECT_EQ(changed([](Numbers& b) { b = List{1}; }), (List{1}));
  EXPECT_EQ(numbers, (List{3, 1, 4}));
}

TEST(Buffer, KeepsTheOwnerUntilTheLastCopyThatBorrowsIsGone) {
  auto owner = std::make_shared<std::vector<uint32_t>>(std::vector<uint32_t>{3, 1, 4});
  const std::weak_ptr<std::vector<uint32_t>> alive = owner;
  auto first = std::make_unique<Numbers>(Numbers::borrow(*owner, owner));
  owner.reset();
  Numbers second = *first;
  first.reset();
  EXPECT_FALSE(alive.expired());
  EXPECT_EQ(second[0], 3u);  // detaches, as `second` is not const
  EXPECT_TRUE(alive.expired());
  EXPECT_EQ(second, (Numbers{3, 1, 4}));
}

TEST(Buffer, GivesItsVectorAwayWithoutCopying) {
  Numbers buffer(std::vector<uint32_t>{3, 1, 4});
  const uint32_t* const at = std::as_const(buffer).data();
  const std::vector<uint32_t> taken = std::move(buffer).vector();
  EXPECT_EQ(taken.data(), at);
  EXPECT_TRUE(buffer.empty());  // NOLINT
  const Numbers borrower = borrowed(taken);
  EXPECT_NE(borrower.vector().data(), taken.data());
  EXPECT_EQ(Numbers(borrower).vector(), taken);
}

TEST(Buffer, OfNothingIsEmptyWhoeverOwnsIt) {
  EXPECT_TRUE(Numbers::borrow({}).empty());
  EXPECT_FALSE(Numbers::borrow({}).is_borrowed());
  const std::vector<uint32_t> numbers{1};
  Numbers none = Numbers::borrow(std::span(numbers).first(0));
  none.push_back(2);
  EXPECT_EQ(none, (Numbers{2}));
}

}  // namespace
}  // namespace maille
