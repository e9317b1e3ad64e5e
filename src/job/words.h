// The words for what options choose between: for reading them, for messages and for reports.
#pragma once

#include "bisector/device.h"
#include "bisector/remesh.h"
#include "bisector/segment.h"
#include "bisector/tree.h"
#include "core/words.h"

namespace bisector::job {

inline constexpr auto kPrecisionWords = word_table<Precision>(
    {{Precision::automatic, "auto"}, {Precision::single, "single"}, {Precision::double_, "double"}});

// "auto" is "nearest", by which reports call it.
inline constexpr auto kNeighbourWords = word_table<NeighbourSource>({{NeighbourSource::nearest, "nearest"},
                                                                     {NeighbourSource::delaunay, "delaunay"},
                                                                     {NeighbourSource::nearest, "auto"}});

inline constexpr auto kTopologyWords = word_table<TopologyControl>(
    {{TopologyControl::enforce, "enforce"}, {TopologyControl::check, "check"}, {TopologyControl::off, "off"}});

inline constexpr auto kDetailWords =
    word_table<DetailMode>({{DetailMode::budget, "auto"}, {DetailMode::all, "all"}, {DetailMode::off, "off"}});

inline constexpr auto kEnergyWords =
    word_table<Energy>({{Energy::automatic, "auto"}, {Energy::restricted, "rcvt"}, {Energy::constrained, "ccvt"}});

inline constexpr auto kPlainEnergyWords =
    word_table<Energy>({{Energy::constrained, "ccvt"}, {Energy::restricted, "rcvt"}});

inline constexpr auto kSurfaceWords = word_table<SegmentSurfaces>(
    {{SegmentSurfaces::planes, "planes"}, {SegmentSurfaces::quadrics, "quadrics"}, {SegmentSurfaces::all, "all"}});

inline constexpr auto kStartWords = word_table<SegmentStart>(
    {{SegmentStart::merging, "merging"}, {SegmentStart::insertion, "insertion"}, {SegmentStart::random, "random"}});

inline constexpr auto kComponentWords =
    word_table<TreeComponents>({{TreeComponents::bridge, "bridge"}, {TreeComponents::separate, "separate"}});

inline constexpr auto kLeafWords = word_table<TreeLeaves>({{TreeLeaves::keep, "keep"}, {TreeLeaves::apart, "apart"}});

inline constexpr auto kUnitWords = word_table<IgesUnit>({{IgesUnit::millimetre, "mm"},
                                                         {IgesUnit::centimetre, "cm"},
                                                         {IgesUnit::metre, "m"},
                                                         {IgesUnit::inch, "in"},
                                                         {IgesUnit::foot, "ft"}});

}  // namespace bisector::job
