// Furniture, in the frame in which FloorPlan places items: origin on the floor in the middle of the
// back, x along the back, y to the front, z up, m.
#ifndef VANTAGE_CORE_SIMULATION_SCENES_FURNITURE_H_
#define VANTAGE_CORE_SIMULATION_SCENES_FURNITURE_H_

#include "core/simulation/random_sequence.h"
#include "core/simulation/scenes/floor_plan.h"
#include "core/simulation/scenes/mesh_builder.h"

namespace vantage::simulation {

// Each adds one piece of the item's size to the builder's frame; details vary with `random`.
void AddTable(const Item& item, RandomSequence& random, MeshBuilder& builder);
void AddChair(const Item& item, RandomSequence& random, MeshBuilder& builder);
void AddSofa(const Item& item, RandomSequence& random, MeshBuilder& builder);
void AddBed(const Item& item, RandomSequence& random, MeshBuilder& builder);
void AddShelf(const Item& item, RandomSequence& random, MeshBuilder& builder);
void AddWardrobe(const Item& item, RandomSequence& random, MeshBuilder& builder);
void AddKitchen(const Item& item, RandomSequence& random, MeshBuilder& builder);
void AddSideboard(const Item& item, RandomSequence& random, MeshBuilder& builder);  // with a screen
void AddDesk(const Item& item, RandomSequence& random, MeshBuilder& builder);
void AddBathtub(const Item& item, RandomSequence& random, MeshBuilder& builder);
void AddToilet(const Item& item, RandomSequence& random, MeshBuilder& builder);
void AddWashstand(const Item& item, RandomSequence& random, MeshBuilder& builder);  // with a mirror
void AddDresser(const Item& item, RandomSequence& random, MeshBuilder& builder);    // with a mirror
void AddPlant(const Item& item, RandomSequence& random, MeshBuilder& builder);
void AddFloorLamp(const Item& item, RandomSequence& random, MeshBuilder& builder);
void AddClutter(const Item& item, RandomSequence& random, MeshBuilder& builder);
void AddPillar(const Item& item, RandomSequence& random, MeshBuilder& builder);

// Small objects on a surface at height `z`, between two corners in plan.
void AddObjects(const Eigen::Vector2d& low, const Eigen::Vector2d& high, double z, int count,
                RandomSequence& random, MeshBuilder& builder);

// Hangs from the ceiling at the middle of the frame.
void AddCeilingLamp(double ceiling, RandomSequence& random, MeshBuilder& builder);

}  // namespace vantage::simulation

#endif  // VANTAGE_CORE_SIMULATION_SCENES_FURNITURE_H_
