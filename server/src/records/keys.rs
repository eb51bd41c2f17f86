//! Every key of a site, in one enum whose bytes sort as its fields do.
//!
//! A key is a tag byte and then its fields, most significant first: numbers as big-endian integers, names as their
//! bytes closed by a zero (names hold no zero). So all values of one run stand together, in the order in which a
//! reader wants them. What belongs to a text carries the generation first: a new generation is written into fresh
//! keys while the old one serves, and dropped by prefix. What belongs to a map carries the version, likewise.

/// Text generations are numbered from 0.
pub type Generation = u32;
/// Runs of a site are numbered from 0 in the order of their making.
pub type RunIdx = u32;
/// Versions of a site's map are numbered from 1.
pub type MapVersion = u64;

/// What of a map stands under the keys of a part.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum PartKind {
    /// Poses of keyframes, run after run.
    Poses = 1,
    /// Labels of observations, run after run.
    Labels = 2,
    /// Places of a component, in pieces.
    Places = 3,
    /// Where and when the stretches of matches were driven, in the order of the matches.
    MatchPlaces = 4,
    /// Rooms of all components, in pieces.
    Rooms = 5,
}

/// Names a stored value of a site.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Key {
    /// What the site is and which generation and map version serve.
    Site,
    /// Number of the run of a name.
    RunName(String),
    /// What a run is; never changes.
    Run(RunIdx),
    /// How far a run has come; changes with every batch.
    RunHead(RunIdx),
    /// Up to 256 scans beginning with a sequence number.
    Scans(RunIdx, u64),
    /// A run was deleted, and traces of it may be left.
    DeletedRun(RunIdx),
    /// How far the text of a run has come.
    TextHead(Generation, RunIdx),
    /// The translator of a run, in parts of less than one mebibyte.
    Checkpoint(Generation, RunIdx, u32),
    /// Up to 256 observations beginning with a number.
    Observations(Generation, RunIdx, u64),
    /// Up to 256 words of one level beginning with a number.
    Words(Generation, RunIdx, u8, u64),
    /// Up to 256 keyframes beginning with a number.
    Keyframes(Generation, RunIdx, u64),
    /// The text of a finished run, packed, in parts of less than one mebibyte.
    PackedText(Generation, RunIdx, u32),
    /// Why a run falls in two before a scan.
    Cut(Generation, RunIdx, u64),
    /// What a map version is.
    Map(MapVersion),
    /// One part of a map version: which kind, and its number within.
    MapPart(MapVersion, PartKind, u64),
    /// A match of a map version.
    Match(MapVersion, u64),
    /// A person's word on a pair of places.
    Decision(u64),
    Job(u64),
    /// Registrations of a build that the end of the server interrupted, in parts of less than one mebibyte.
    Registrations(u32),
    /// What a person drew into the map.
    Annotation(u64),
    /// Where a channel points, by its name.
    Channel(String),
    /// Which version a robot drives by: the channel's name and its own.
    ChannelRobot(String, String),
}

impl Key {
    /// The bytes under which the value is stored.
    pub fn encode(&self) -> Vec<u8> {
        match self {
            Key::Site => Writer::new(0x01).done(),
            Key::RunName(name) => Writer::new(0x02).name(name).done(),
            Key::Run(run) => Writer::new(0x03).u32(*run).done(),
            Key::RunHead(run) => Writer::new(0x04).u32(*run).done(),
            Key::Scans(run, first) => Writer::new(0x05).u32(*run).u64(*first).done(),
            Key::DeletedRun(run) => Writer::new(0x06).u32(*run).done(),
            Key::TextHead(generation, run) => Writer::new(0x10).u32(*generation).u32(*run).done(),
            Key::Checkpoint(generation, run, part) => {
                Writer::new(0x11).u32(*generation).u32(*run).u32(*part).done()
            }
            Key::Observations(generation, run, first) => {
                Writer::new(0x12).u32(*generation).u32(*run).u64(*first).done()
            }
            Key::Words(generation, run, level, first) => {
                Writer::new(0x13).u32(*generation).u32(*run).u8(*level).u64(*first).done()
            }
            Key::Keyframes(generation, run, first) => {
                Writer::new(0x14).u32(*generation).u32(*run).u64(*first).done()
            }
            Key::PackedText(generation, run, part) => {
                Writer::new(0x15).u32(*generation).u32(*run).u32(*part).done()
            }
            Key::Cut(generation, run, scan_seq) => {
                Writer::new(0x16).u32(*generation).u32(*run).u64(*scan_seq).done()
            }
            Key::Map(version) => Writer::new(0x20).u64(*version).done(),
            Key::MapPart(version, kind, part) => {
                Writer::new(0x21).u64(*version).u8(*kind as u8).u64(*part).done()
            }
            Key::Match(version, number) => Writer::new(0x22).u64(*version).u64(*number).done(),
            Key::Decision(number) => Writer::new(0x30).u64(*number).done(),
            Key::Job(number) => Writer::new(0x31).u64(*number).done(),
            Key::Registrations(part) => Writer::new(0x32).u32(*part).done(),
            Key::Annotation(number) => Writer::new(0x33).u64(*number).done(),
            Key::Channel(name) => Writer::new(0x34).name(name).done(),
            Key::ChannelRobot(channel, robot) => Writer::new(0x35).name(channel).name(robot).done(),
        }
    }

    /// The prefix of all scans of a run.
    pub fn all_scans(run: RunIdx) -> Vec<u8> {
        Writer::new(0x05).u32(run).done()
    }

    /// The prefix of all runs that were deleted and may have left traces.
    pub fn all_deleted_runs() -> Vec<u8> {
        vec![0x06]
    }

    /// The run that the key of a deleted one names.
    pub fn deleted_run(key: &[u8]) -> Option<RunIdx> {
        key.last_chunk().map(|bytes| u32::from_be_bytes(*bytes))
    }

    /// The prefixes of everything of a run that belongs to a text generation.
    pub fn all_of_text(generation: Generation, run: RunIdx) -> Vec<Vec<u8>> {
        (0x10..=0x16).map(|tag| Writer::new(tag).u32(generation).u32(run).done()).collect()
    }

    /// The prefix of all observations of a run.
    pub fn all_observations(generation: Generation, run: RunIdx) -> Vec<u8> {
        Writer::new(0x12).u32(generation).u32(run).done()
    }

    /// The prefix of all words of a level of a run.
    pub fn all_words(generation: Generation, run: RunIdx, level: u8) -> Vec<u8> {
        Writer::new(0x13).u32(generation).u32(run).u8(level).done()
    }

    /// The prefix of all keyframes of a run.
    pub fn all_keyframes(generation: Generation, run: RunIdx) -> Vec<u8> {
        Writer::new(0x14).u32(generation).u32(run).done()
    }

    /// The prefix of all cuts of a run.
    pub fn all_cuts(generation: Generation, run: RunIdx) -> Vec<u8> {
        Writer::new(0x16).u32(generation).u32(run).done()
    }

    /// The prefix of all packed texts of a generation.
    pub fn all_packed_texts(generation: Generation) -> Vec<u8> {
        Writer::new(0x15).u32(generation).done()
    }

    /// The run that a packed text's key names.
    pub fn run_of_packed_text(key: &[u8]) -> Option<RunIdx> {
        key.get(5..)?.first_chunk().map(|bytes| u32::from_be_bytes(*bytes))
    }

    /// The prefixes of everything that belongs to a text generation.
    pub fn all_of_generation(generation: Generation) -> Vec<Vec<u8>> {
        (0x10..=0x16).map(|tag| Writer::new(tag).u32(generation).done()).collect()
    }

    /// The prefix of all parts of one kind of a map version.
    pub fn all_map_parts(version: MapVersion, kind: PartKind) -> Vec<u8> {
        Writer::new(0x21).u64(version).u8(kind as u8).done()
    }

    /// The prefix of the places of a component.
    pub fn all_places(version: MapVersion, component: u32) -> Vec<u8> {
        Writer::new(0x21).u64(version).u8(PartKind::Places as u8).u32(component).done()
    }

    /// A piece of the places of a component.
    pub fn places(version: MapVersion, component: u32, piece: u32) -> Self {
        Key::MapPart(version, PartKind::Places, u64::from(component) << 32 | u64::from(piece))
    }

    /// The prefix of all matches of a map version.
    pub fn all_matches(version: MapVersion) -> Vec<u8> {
        Writer::new(0x22).u64(version).done()
    }

    /// The prefix of all map versions.
    pub fn all_maps() -> Vec<u8> {
        vec![0x20]
    }

    /// The prefixes of everything that belongs to a map version.
    pub fn all_of_map(version: MapVersion) -> Vec<Vec<u8>> {
        (0x20..=0x22).map(|tag| Writer::new(tag).u64(version).done()).collect()
    }

    /// The prefix of all decisions.
    pub fn all_decisions() -> Vec<u8> {
        vec![0x30]
    }

    /// The prefix of all jobs.
    pub fn all_jobs() -> Vec<u8> {
        vec![0x31]
    }

    /// The prefix of all registrations.
    pub fn all_registrations() -> Vec<u8> {
        vec![0x32]
    }

    /// The prefix of all annotations.
    pub fn all_annotations() -> Vec<u8> {
        vec![0x33]
    }

    /// The prefix of all channels.
    pub fn all_channels() -> Vec<u8> {
        vec![0x34]
    }

    /// The prefix of what the robots of a channel said.
    pub fn all_channel_robots(channel: &str) -> Vec<u8> {
        Writer::new(0x35).name(channel).done()
    }

    /// The name that closes a key.
    pub fn last_name(key: &[u8]) -> Option<String> {
        let names = key.get(1..)?.strip_suffix(&[0])?;
        String::from_utf8(names.rsplit(|byte| *byte == 0).next()?.to_vec()).ok()
    }

    /// The big-endian number that closes a key, such as the first sequence number of a chunk.
    pub fn last_u64(key: &[u8]) -> Option<u64> {
        key.last_chunk().map(|bytes| u64::from_be_bytes(*bytes))
    }
}

/// Appends fields so that bytes sort as the fields do.
struct Writer(Vec<u8>);

impl Writer {
    fn new(tag: u8) -> Self {
        Self(vec![tag])
    }

    fn u8(mut self, value: u8) -> Self {
        self.0.push(value);
        self
    }

    fn u32(mut self, value: u32) -> Self {
        self.0.extend(value.to_be_bytes());
        self
    }

    fn u64(mut self, value: u64) -> Self {
        self.0.extend(value.to_be_bytes());
        self
    }

    fn name(mut self, name: &str) -> Self {
        self.0.extend(name.as_bytes());
        self.0.push(0);
        self
    }

    fn done(self) -> Vec<u8> {
        self.0
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn any_part() -> impl Strategy<Value = PartKind> {
        prop_oneof![
            Just(PartKind::Poses),
            Just(PartKind::Labels),
            Just(PartKind::Places),
            Just(PartKind::MatchPlaces),
            Just(PartKind::Rooms)
        ]
    }

    fn any_key() -> impl Strategy<Value = Key> {
        prop_oneof![
            Just(Key::Site),
            "[A-Za-z0-9._-]{1,8}".prop_map(Key::RunName),
            any::<u32>().prop_map(Key::Run),
            any::<u32>().prop_map(Key::RunHead),
            any::<(u32, u64)>().prop_map(|(run, first)| Key::Scans(run, first)),
            any::<u32>().prop_map(Key::DeletedRun),
            any::<(u32, u32)>().prop_map(|(generation, run)| Key::TextHead(generation, run)),
            any::<(u32, u32, u32)>().prop_map(|(g, run, part)| Key::Checkpoint(g, run, part)),
            any::<(u32, u32, u64)>().prop_map(|(g, run, first)| Key::Observations(g, run, first)),
            any::<(u32, u32, u8, u64)>().prop_map(|(g, run, level, first)| Key::Words(g, run, level, first)),
            any::<(u32, u32, u64)>().prop_map(|(g, run, first)| Key::Keyframes(g, run, first)),
            any::<(u32, u32, u32)>().prop_map(|(g, run, part)| Key::PackedText(g, run, part)),
            (any::<u64>(), any_part(), any::<u64>()).prop_map(|(v, kind, part)| Key::MapPart(v, kind, part)),
            any::<(u64, u64)>().prop_map(|(v, number)| Key::Match(v, number)),
            any::<(u32, u32, u64)>().prop_map(|(g, run, scan_seq)| Key::Cut(g, run, scan_seq)),
            any::<u64>().prop_map(Key::Decision),
            any::<u64>().prop_map(Key::Job),
            any::<u32>().prop_map(Key::Registrations),
            any::<u64>().prop_map(Key::Annotation),
            "[A-Za-z0-9._-]{1,8}".prop_map(Key::Channel),
            ("[A-Za-z0-9._-]{1,8}", "[A-Za-z0-9._-]{1,8}").prop_map(|(c, robot)| Key::ChannelRobot(c, robot)),
        ]
    }

    proptest! {
        #[test]
        fn bytes_sort_as_keys_do(a in any_key(), b in any_key()) {
            prop_assert_eq!(a.encode().cmp(&b.encode()), a.cmp(&b));
        }
    }

    #[test]
    fn prefixes_hold_their_keys_and_no_others() {
        assert!(Key::Scans(7, 9).encode().starts_with(&Key::all_scans(7)));
        assert!(!Key::Scans(8, 9).encode().starts_with(&Key::all_scans(7)));
        assert!(Key::Words(1, 2, 3, 4).encode().starts_with(&Key::all_words(1, 2, 3)));
        assert!(Key::places(1, 2, 3).encode().starts_with(&Key::all_places(1, 2)));
        assert!(!Key::places(1, 3, 3).encode().starts_with(&Key::all_places(1, 2)));
        assert_eq!(Key::run_of_packed_text(&Key::PackedText(1, 7, 2).encode()), Some(7));
        assert_eq!(Key::deleted_run(&Key::DeletedRun(7).encode()), Some(7));
        assert_eq!(Key::last_u64(&Key::Scans(7, 9).encode()), Some(9));
        let robot = Key::ChannelRobot("stable".into(), "r7".into()).encode();
        assert!(robot.starts_with(&Key::all_channel_robots("stable")));
        assert!(!robot.starts_with(&Key::all_channel_robots("stab")));
        assert_eq!(Key::last_name(&robot).as_deref(), Some("r7"));
        assert_eq!(Key::last_name(&Key::Channel("stable".into()).encode()).as_deref(), Some("stable"));
    }
}
