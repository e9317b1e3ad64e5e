// A tree of boxes over the seeds: a leaf has kTreeArity seeds, other nodes as many nodes of the level below, in the
// order of slots. As that is a spatial order, boxes are small wherever seeds lie close, however they are spread. Boxes
// are in single precision and somewhat too large; so they only ever cost time.
//
// To include: TREE_PUSH_CONSTANTS and the buffer `boxes` of floats.

uint nodes_of(uint level) { return level_begin[level + 1] - level_begin[level]; }

// A lower bound of the squared distance of what lies in the box.
float box_distance(uint level, uint node, vec3 q) {
  const uint at = kBoxWords * (level_begin[level] + node);
  const vec3 lower = vec3(boxes[at], boxes[at + 1], boxes[at + 2]);
  const vec3 upper = vec3(boxes[at + 3], boxes[at + 4], boxes[at + 5]);
  precise vec3 below = lower - q;
  precise vec3 above = q - upper;
  const vec3 apart = max(max(below, above), vec3(0.0));
  precise float squared = (apart.x * apart.x + apart.y * apart.y + apart.z * apart.z) * 0.99999;
  return squared;
}

// The leaf that greedy descent leads to: not always the nearest.
uint likely_leaf(vec3 q) {
  uint node = 0;
  [[dont_unroll]] for (uint level = top_level; level > 0; --level) {
    const uint first = node * kTreeArity, end = min(first + kTreeArity, nodes_of(level - 1));
    float least = 3e38;
    node = first;
    [[dont_unroll]] for (uint child = first; child < end; ++child) {
      const float squared = box_distance(level - 1, child, q);
      if (squared < least) {
        least = squared;
        node = child;
      }
    }
  }
  return node;
}

// Goes from a node on to the next in the order of slots that is not below it; false at the end.
bool next_node(inout uint level, inout uint node) {
  [[dont_unroll]] while (level < top_level && (node % kTreeArity == kTreeArity - 1 || node + 1 == nodes_of(level))) {
    node /= kTreeArity;
    ++level;
  }
  if (level == top_level) return false;
  ++node;
  return true;
}
