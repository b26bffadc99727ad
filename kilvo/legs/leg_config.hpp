// Settings of the legs. No length, weight or speed of a particular robot is in them: speeds are compared with the robot's own steps.
#pragma once

#include <memory>
#include <string>
#include <tuple>

#include "kilvo/math/field.hpp"

namespace kilvo {

class ContactDetector;

struct LegConfig {
  std::string contact = "kilvo";           // kilvo | paper | variance | force
  double velocity_sigma = 0.005;           // m/s
  double vertical_velocity_sigma = 0.015;  // m/s
  double velocity_correlation = 0.2;       // s
  double position_sigma = 0.0005;          // m
  double position_correlation = 0.5;       // s
  double ground_sigma = 0.02;              // m
  double entry_delay = 0.016;              // s
  double gate = 5.0;
  // What the paper has otherwise: docs/decisions/paper.md.
  int iterations = 1;
  std::string adaptation = "foot";  // foot | row | none
  std::string height = "ki";        // ki | always | never
  std::string ground = "map";       // map | contacts
  // Makes the method that `contact` names; ours needs none.
  std::unique_ptr<ContactDetector> (*detector)() = nullptr;

  static constexpr auto fields() {
    return std::tuple{
        Field{"contact", &LegConfig::contact, "-",
              "how contacts are estimated: kilvo (our method); for comparison: paper (Section V as printed), variance (of the "
              "acceleration), force (a threshold on the force from the joint efforts)"},
        Field{"velocity_sigma", &LegConfig::velocity_sigma, "m/s", "standard deviation of the velocity of a stance foot"},
        Field{"vertical_velocity_sigma", &LegConfig::vertical_velocity_sigma, "m/s",
              "the same along the vertical, where soles settle and roll alike at every step; until a LiDAR shows it"},
        Field{"velocity_correlation", &LegConfig::velocity_correlation, "s", "correlation time of that: rows closer together share it"},
        Field{"position_sigma", &LegConfig::position_sigma, "m", "standard deviation of the position of a stance foot"},
        Field{"position_correlation", &LegConfig::position_correlation, "s", "correlation time of that"},
        Field{"ground_sigma", &LegConfig::ground_sigma, "m",
              "standard deviation of a foot's height over the map's ground at touchdown, without LiDAR"},
        Field{"entry_delay", &LegConfig::entry_delay, "s", "a foot is used so long after the last sample that did not show its touchdown"},
        Field{"gate", &LegConfig::gate, "sigma", "a stance foot that moves more than this has a smaller weight"},
        Field{"iterations", &LegConfig::iterations, "-", "iterations of one update by the legs at most"},
        Field{
            "adaptation", &LegConfig::adaptation, "-",
            "variance of a foot that moves (Eq. 8): foot (larger, all its rows alike), row (larger, each row by itself), none (the same)"},
        Field{"height", &LegConfig::height, "-",
              "when the height over the ground counts at touchdown: ki (without LiDAR), always (in every modality), never"},
        Field{"ground", &LegConfig::ground, "-",
              "which ground that is: map (of the LiDAR's map, else the level floor, else level with the other foot) or contacts (the plane "
              "of the last contacts)"}};
  }
};

}  // namespace kilvo
