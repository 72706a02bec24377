// Version 4.1 of Gmsh's .msh files: entities, and nodes and elements in blocks.
#include "io/gmsh/gmsh_reader.h"

namespace maille {

// Reads over the partitions and the ghosts; the partition of an element is not kept.
Result<> GmshReader::read_partitions() {
  int64_t partitions = 0, ghosts = 0, value = 0;
  if (!size(partitions) || !size(ghosts)) return expected("the numbers of partitions and ghosts");
  for (int64_t i = 0; i < ghosts; ++i) {
    if (!integer(value) || !integer(value)) return expected("an entity of ghosts and its partition");
  }
  notes_.push_back("partitions left out");
  return {};
}

Result<> GmshReader::skip_parent() {
  int64_t partitions = 0, value = 0;
  if (!integer(value) || !integer(value) || !size(partitions))
    return expected("an entity's parent and its number of partitions");
  for (int64_t i = 0; i < partitions; ++i) {
    if (!integer(value)) return expected("a partition of an entity");
  }
  return {};
}

/// Of a mesh that was partitioned, elements are of the entities of partitions: these have the groups.
Result<> GmshReader::read_entities(bool partitioned) {
  if (partitioned) MAILLE_CHECK(read_partitions());
  int64_t counts[4] = {};
  for (int64_t& count : counts) {
    if (!size(count) || count < 0) return expected("the numbers of entities");
  }
  for (int dimension = 0; dimension < 4; ++dimension) {
    for (int64_t i = 0; i < counts[dimension]; ++i) {
      // 64 bytes stand for a node of the map with its vector; the number is estimated, not measured.
      MAILLE_CHECK(budget_.take(1, 64));
      int64_t tag = 0, groups = 0, group = 0;
      double box = 0;
      if (!integer(tag)) return expected("the tag of an entity");
      if (partitioned) MAILLE_CHECK(skip_parent());
      for (int k = 0; k < (dimension == 0 ? 3 : 6); ++k) {
        if (!real(box)) return expected("the box of an entity");
      }
      // A later section of partitioned entities replaces what Entities said of the same tag.
      std::vector<int64_t>& physical = entities_[{dimension, tag}];
      physical.clear();
      if (!size(groups)) return expected("the number of groups of an entity");
      for (int64_t k = 0; k < groups; ++k) {
        if (!integer(group)) return expected("a group of an entity");
        physical.push_back(group);
      }
      if (dimension == 0) continue;
      if (!size(groups)) return expected("the number of entities at an entity's border");
      for (int64_t k = 0; k < groups; ++k) {
        if (!integer(group)) return expected("an entity at an entity's border");
      }
    }
  }
  return {};
}

Result<> GmshReader::read_nodes_4() {
  int64_t head[4] = {}, blocks_done = 0;
  for (int64_t& value : head) {
    if (!size(value)) return expected("the numbers of blocks and nodes");
  }
  // The head has the numbers of blocks and nodes, and the least and largest number, which are not needed.
  if (has_nodes_ || head[1] < 0 || static_cast<uint64_t>(head[1]) > max_points)
    return malformed("there are two sections of nodes, or 2^32 nodes and more");
  const auto total = static_cast<uint64_t>(head[1]);
  for (; blocks_done < head[0]; ++blocks_done) {
    int64_t dimension = 0, tag = 0, parametric = 0, count = 0, number = 0;
    if (!integer(dimension) || !integer(tag) || !integer(parametric) || !size(count))
      return expected("the head of a block of nodes");
    if (count < 0 || static_cast<uint64_t>(count) > total - nodes_.size())
      return malformed("the blocks have more nodes than the section says");
    const uint64_t first = nodes_.size();
    for (int64_t i = 0; i < count; ++i) {
      MAILLE_CHECK(pace_.step(nodes_.size(), total, 4 * sizeof(double), in_.scanner.position()));
      if (!size(number)) return expected("the number of a node");
      nodes_.add(number);
    }
    // A hostile head may announce 2^63 empty blocks: the loop has to end with the file.
    if (count == 0 && in_.scanner.at_end()) return expected("more blocks of nodes");
    // A node on a curve has one parameter, on a surface two, in a volume three.
    const int64_t more = parametric != 0 ? std::clamp<int64_t>(dimension, 0, 3) : 0;
    // In version 4.1 all numbers of a block come first, then all its coordinates.
    for (uint64_t i = first; i < nodes_.size(); ++i) {
      MAILLE_CHECK(read_point());
      double skipped = 0;
      for (int64_t k = 0; k < more; ++k) {
        if (!real(skipped)) return expected("a parametric coordinate of a node");
      }
    }
    if (more != 0) parametric_ += static_cast<uint64_t>(count);
  }
  if (nodes_.size() != total) return malformed("the blocks have fewer nodes than the section says");
  has_nodes_ = true;
  nodes_.finish();
  return {};
}

Result<> GmshReader::read_elements_4() {
  int64_t head[4] = {};
  for (int64_t& value : head) {
    if (!size(value)) return expected("the numbers of blocks and elements");
  }
  for (int64_t block = 0; block < head[0]; ++block) {
    int64_t dimension = 0, tag = 0, type_number = 0, count = 0, number = 0;
    if (!integer(dimension) || !integer(tag) || !integer(type_number) || !size(count))
      return expected("the head of a block of elements");
    const GmshType* const type = gmsh_type(type_number);
    if (type == nullptr)
      return malformed("element type " + std::to_string(type_number) +
                       " cannot be read; types up to second order can");
    // In version 4 the elements of a block belong to an entity, and physical groups belong to entities, not
    // to elements.
    const auto entity = entities_.find({static_cast<int>(dimension), tag});
    const bool grouped = entity != entities_.end() && !entity->second.empty();
    const int64_t physical = grouped ? entity->second[0] : 0;
    if (grouped && entity->second.size() > 1 && count > 0) {
      notes_.push_back("entity " + std::to_string(tag) + " of dimension " + std::to_string(dimension) +
                       " is in " + std::to_string(entity->second.size()) +
                       " physical groups; its elements keep the first");
    }
    // As with nodes: empty blocks without end must not keep this loop going.
    if (count <= 0 && in_.scanner.at_end()) return expected("more blocks of elements");
    for (int64_t i = 0; i < count; ++i) {
      MAILLE_CHECK(pace_.step(static_cast<uint64_t>(i), static_cast<uint64_t>(count),
                              (type->nodes + 6) * sizeof(uint32_t), in_.scanner.position()));
      if (!size(number)) return expected("the number of an element");
      MAILLE_CHECK(add_element(*type, number, physical, tag));
    }
  }
  return {};
}

}  // namespace maille
