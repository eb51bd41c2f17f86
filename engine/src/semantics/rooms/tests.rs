//! Drawn floors, and laws of random ones.

use super::*;
use crate::occupancy::CellState;
use proptest::prelude::*;

/// Two rooms of 4 × 4 m on a corridor of 2 m, each with a door of 1 m; a person stands in the left one.
fn building() -> GridMap {
    let mut grid = GridMap::unknown(92, 72, 0.1, Point2::new(-1.0, 2.0));
    let mut free = |columns: std::ops::Range<i64>, rows: std::ops::Range<i64>| {
        for row in rows {
            columns.clone().for_each(|column| grid.set(column, row, CellState::Free));
        }
    };
    free(2..90, 2..22);
    free(2..42, 24..64);
    free(50..90, 24..64);
    free(17..27, 22..24);
    free(65..75, 22..24);
    for (column, row) in [(10, 40), (11, 40), (10, 41), (11, 41)] {
        grid.set(column, row, CellState::Occupied);
    }
    grid
}

#[test]
fn two_rooms_on_a_corridor_are_three_rooms_and_two_doors() {
    let found = find_rooms(&building(), &RoomsConfig::default());
    let kinds: Vec<RoomKind> = found.rooms.iter().map(|room| room.kind).collect();
    assert_eq!(kinds, [RoomKind::Corridor, RoomKind::Room, RoomKind::Room]);
    assert_eq!(found.rooms[0].neighbors, [1, 2]);
    assert_eq!(found.rooms[1].neighbors, [0]);
    for (room, area_m2) in found.rooms.iter().zip([17.6, 16.0, 16.0]) {
        assert!((room.area_m2 - area_m2).abs() < 0.5, "{}", room.area_m2);
    }
    let joined: Vec<(u32, u32)> = found.doors.iter().map(|door| door.rooms).collect();
    assert_eq!(joined, [(0, 1), (0, 2)]);
    for (door, x) in found.doors.iter().zip([1.2, 6.0]) {
        assert!(door.position.distance(&Point2::new(x, 4.3)) < 0.3, "{:?}", door.position);
        assert!((door.width_m - 1.0).abs() < 0.25, "{}", door.width_m);
    }
}

#[test]
fn points_are_told_their_room_and_walls_have_none() {
    let found = find_rooms(&building(), &RoomsConfig::default());
    assert_eq!(found.room_at(&Point2::new(3.5, 3.2)), Some(0));
    assert_eq!(found.room_at(&Point2::new(0.1, 6.1)), Some(1), "where the person stands is room, too");
    assert_eq!(found.room_at(&Point2::new(3.6, 6.0)), None);
    assert_eq!(found.room_at(&Point2::new(-50.0, f64::NAN)), None);
    assert_eq!(found.room_at(&Point2::new(1e9, 1e9)), None);
}

#[test]
fn a_hall_and_the_corridor_that_opens_into_it_are_two() {
    let mut grid = GridMap::unknown(200, 100, 0.1, Point2::default());
    for row in 2..98 {
        (2..100).for_each(|column| grid.set(column, row, CellState::Free));
    }
    for row in 42..58 {
        (100..198).for_each(|column| grid.set(column, row, CellState::Free));
    }
    let found = find_rooms(&grid, &RoomsConfig::default());
    let kinds: Vec<RoomKind> = found.rooms.iter().map(|room| room.kind).collect();
    assert_eq!(kinds, [RoomKind::Hall, RoomKind::Corridor]);
    assert!(found.doors[0].position.distance(&Point2::new(10.0, 5.0)) < 1.0, "{:?}", found.doors);
}

#[test]
fn nothing_free_is_no_room() {
    let found = find_rooms(&GridMap::unknown(5, 4, 0.1, Point2::default()), &RoomsConfig::default());
    assert!(found.rooms.is_empty() && found.doors.is_empty());
}

#[test]
fn settings_that_cannot_work_are_named() {
    let config = RoomsConfig { door_share: 1.5, ..RoomsConfig::default() };
    assert!(config.validate("rooms").unwrap_err().to_string().contains("rooms.door_share"));
    assert!(RoomsConfig::default().validate("rooms").is_ok());
}

/// Every disc of every cell drawn, the definition.
fn thickness_by_definition(floor: &Floor, clearance: &[f32]) -> Vec<f32> {
    let at = |cell: usize| ((cell % floor.width) as f32, (cell / floor.width) as f32);
    let covers = |center: usize, cell: usize| {
        let ((x, y), (u, v)) = (at(center), at(cell));
        (x - u).powi(2) + (y - v).powi(2) <= clearance[center].powi(2)
    };
    let largest = |cell: usize| {
        let covering = (0..clearance.len()).filter(|&center| covers(center, cell));
        covering.map(|center| clearance[center]).fold(0.0, f32::max)
    };
    (0..clearance.len()).map(|cell| if clearance[cell] > 0.0 { largest(cell) } else { 0.0 }).collect()
}

prop_compose! {
    fn floors()(width in 2usize..22, height in 2usize..22)
        (cells in prop::collection::vec(prop::bool::weighted(0.93), width * height), width in Just(width)) -> GridMap {
        let state = |is_free: &bool| if *is_free { CellState::Free } else { CellState::Occupied };
        GridMap::new(width, 0.2, Point2::default(), cells.iter().map(state).collect()).unwrap()
    }
}

proptest! {
    #[test]
    fn thickness_is_the_largest_disc_but_for_a_few_cells(grid in floors()) {
        let floor = Floor::of_grid(&grid, 0.0);
        let clearance = distance_to_blocked(floor.width, floor.height, &floor.is_free);
        let fast = thickness::thickness(&floor, &clearance);
        for (fast, slow) in fast.iter().zip(thickness_by_definition(&floor, &clearance)) {
            prop_assert!(*fast <= slow && *fast >= slow - 3.0, "{} for {}", fast, slow);
        }
    }

    #[test]
    fn rooms_cover_the_floor_once_and_doors_join_neighbors(grid in floors()) {
        let config = RoomsConfig { room_area_min_m2: 0.2, obstacle_size_m: 0.0, ..RoomsConfig::default() };
        let found = find_rooms(&grid, &config);
        let mut num_cells = vec![0; found.rooms.len()];
        for (cell, state) in grid.cells().iter().enumerate() {
            let room = found.room_at(&grid.center_of((cell % grid.width()) as i64, (cell / grid.width()) as i64));
            prop_assert!(room.is_none() || *state == CellState::Free);
            if let Some(room) = room {
                num_cells[room as usize] += 1;
            }
        }
        for (room, num_cells) in found.rooms.iter().zip(num_cells) {
            prop_assert!((room.area_m2 - f64::from(num_cells) * 0.04).abs() < 1e-9);
            prop_assert!(room.area_m2 >= 0.2 - 1e-9 && room.rings[0].len() >= 3);
        }
        for door in &found.doors {
            let (first, second) = door.rooms;
            prop_assert!(first < second);
            prop_assert!(found.rooms[first as usize].neighbors.contains(&second));
            prop_assert!(found.rooms[second as usize].neighbors.contains(&first));
        }
        prop_assert_eq!(find_rooms(&grid, &config), found);
    }
}
