//! rosbag2 sqlite3 data bases: a table of topics and a table of messages.
//!
//! Opened read-only and as immutable, so that sqlite neither locks nor writes anything beside the recording.

use std::collections::BTreeMap;
use std::io::Read;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, MutexGuard, PoisonError};

use rusqlite::types::ValueRef;
use rusqlite::{Connection, OpenFlags};
use vice_core::error::{DataError, DataResult};
use vice_core::time::Stamp;

use super::unpack::{beyond_usual, log_of, most_beyond_usual, most_of_message, too_much};
use super::{Container, HEAD_BYTES, Locator, MAX_MESSAGE_BYTES, Message, Payload, Scan, Visitor, Want};

/// What a data base starts with.
pub(super) const MAGIC: &[u8] = b"SQLite format 3\0";

/// A data base.
pub(super) struct Db3 {
    path: PathBuf,
    connection: Mutex<Connection>,
    /// Each message is compressed with zstd.
    compressed: bool,
    /// Bytes of the file, more than which no message can have.
    len: u64,
}

/// Whether a data base has the tables of rosbag2.
pub(super) fn is_rosbag2(path: &Path) -> bool {
    let tables = "SELECT count(*) FROM sqlite_master WHERE type = 'table' AND name IN ('topics', 'messages')";
    connect(path, false).and_then(|c| c.query_row(tables, [], |r| r.get::<_, i64>(0))).is_ok_and(|n| n == 2)
}

/// Connects to a data base; one that is a `copy` of ours may be written to, so that sqlite can merge its log.
fn connect(path: &Path, copy: bool) -> rusqlite::Result<Connection> {
    // Of the path in an URI only what would end or escape it matters.
    let text = path.to_string_lossy().replace('%', "%25").replace('?', "%3f").replace('#', "%23");
    let access = if copy { OpenFlags::SQLITE_OPEN_READ_WRITE } else { OpenFlags::SQLITE_OPEN_READ_ONLY };
    let flags = access
        | OpenFlags::SQLITE_OPEN_URI
        | OpenFlags::SQLITE_OPEN_NO_MUTEX
        | OpenFlags::SQLITE_OPEN_EXRESCODE;
    let immutable = if copy { "" } else { "?immutable=1" };
    let connection = Connection::open_with_flags(format!("file:{text}{immutable}"), flags)?;
    // Nothing can be written through this connection. What this allows is to read a file that is shorter than its
    // header says, which sqlite would refuse as a whole.
    connection.execute_batch("PRAGMA writable_schema = ON")?;
    Ok(connection)
}

fn failed(what: impl Into<String>) -> impl FnOnce(rusqlite::Error) -> DataError {
    let what = what.into();
    move |e| DataError::new(format!("{what}: {e}"))
}

impl Db3 {
    /// Opens the data base at `place`, which is a `copy` where that of the user at `path` could not be read as it is.
    pub(super) fn open(path: &Path, place: &Path, compressed: bool, copy: bool) -> DataResult<Self> {
        let connection =
            connect(place, copy).map_err(|e| failed("the data base cannot be opened")(e).at(path))?;
        // Without its description the messages still say that they are compressed: CDR never starts like this.
        let first = "SELECT hex(substr(data, 1, 4)) FROM messages ORDER BY id LIMIT 1";
        let first = connection.query_row(first, [], |row| row.get::<_, String>(0));
        let compressed = compressed || first.is_ok_and(|head| head == "28B52FFD");
        // A message that is still in the log has its bytes there.
        let files = [place.to_path_buf(), log_of(place)];
        let len = files.iter().filter_map(|p| p.metadata().ok()).map(|m| m.len()).sum();
        Ok(Self { path: path.to_path_buf(), connection: Mutex::new(connection), compressed, len })
    }

    fn lock(&self) -> MutexGuard<'_, Connection> {
        self.connection.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// The topics by their number in the data base, with the number in `scan`.
    fn topics(&self, scan: &mut Scan, visitor: &mut dyn Visitor) -> rusqlite::Result<BTreeMap<i64, usize>> {
        let connection = self.lock();
        let mut query =
            connection.prepare("SELECT id, name, type, serialization_format FROM topics ORDER BY id")?;
        let mut rows = query.query([])?;
        let mut topics = BTreeMap::new();
        while let Some(row) = rows.next()? {
            let (name, kind, format): (String, String, String) = (row.get(1)?, row.get(2)?, row.get(3)?);
            topics.insert(row.get(0)?, scan.topic(&name, &kind, &format, visitor));
        }
        Ok(topics)
    }

    /// `HEAD_BYTES` or all of a message of a row.
    fn message(&self, connection: &Connection, row: i64, head: bool) -> DataResult<Vec<u8>> {
        let name = || format!("message {row} cannot be read");
        let mut blob = connection.blob_open("main", "messages", "data", row, true).map_err(failed(name()))?;
        let size = blob.len() as u64;
        if size > MAX_MESSAGE_BYTES.min(self.len) {
            return Err(DataError::new(format!("message {row} claims {size} bytes")));
        }
        let read = |e: std::io::Error| DataError::new(format!("message {row} cannot be read: {e}"));
        let mut bytes = Vec::new();
        if !self.compressed {
            let wanted = if head { size.min(HEAD_BYTES as u64) } else { size } as usize;
            bytes.resize(wanted, 0);
            blob.read_exact(&mut bytes).map_err(read)?;
            return Ok(bytes);
        }
        let most = most_of_message(size);
        let limit = if head { HEAD_BYTES as u64 } else { MAX_MESSAGE_BYTES.min(most + 1) };
        let decoder = zstd::stream::read::Decoder::new(blob).map_err(read)?;
        decoder.take(limit).read_to_end(&mut bytes).map_err(read)?;
        if bytes.len() as u64 > most {
            return Err(DataError::new(format!("message {row}: {}", too_much(size))));
        }
        Ok(bytes)
    }

    /// Visits the rows after `last` in order; `last` follows. An error is damage at the row after it.
    fn walk(
        &self,
        file: u32,
        topics: &BTreeMap<i64, usize>,
        last: &mut i64,
        scan: &mut Scan,
        visitor: &mut dyn Visitor,
    ) -> DataResult<()> {
        let connection = self.lock();
        let wrong = || failed("the table of messages is damaged");
        // Messages that are wanted as a whole come with their row; of images only the first bytes are touched.
        let whole = topics.iter().filter(|(_, t)| scan.wants[**t] == Want::All && !self.compressed);
        let whole: Vec<String> = whole.map(|(id, _)| id.to_string()).collect();
        let query = format!(
            "SELECT id, topic_id, timestamp, CASE WHEN topic_id IN ({}) THEN data END FROM messages \
             WHERE id > ?1 ORDER BY id",
            whole.join(",")
        );
        let mut query = connection.prepare(&query).map_err(wrong())?;
        let mut rows = query.query([*last]).map_err(wrong())?;
        let mut unpacked = 0;
        while let Some(row) = rows.next().map_err(wrong())? {
            let id: i64 = row.get(0).map_err(wrong())?;
            let (topic, nanos): (i64, i64) = (row.get(1).map_err(wrong())?, row.get(2).map_err(wrong())?);
            *last = id;
            let Some(&topic) = topics.get(&topic) else {
                return Err(DataError::new(format!("a message of unknown topic {topic}")));
            };
            let recorded = Stamp::from_nanos(nanos);
            scan.topics[topic].note(recorded, 1);
            let want = scan.wants[topic];
            if want == Want::Nothing {
                continue;
            }
            let read;
            let bytes = match row.get_ref(3).map_err(wrong())? {
                ValueRef::Blob(bytes) => bytes,
                _ => {
                    read = self.message(&connection, id, want == Want::Head)?;
                    unpacked += read.len() as u64;
                    // Of all messages together no more than the file could hold.
                    if self.compressed && beyond_usual(self.len, unpacked) > most_beyond_usual() {
                        return Err(DataError::new(format!(
                            "up to message {id} they unpack to too much: {}",
                            too_much(self.len)
                        )));
                    }
                    &read
                }
            };
            let locator = Locator { file, block: 0, at: id as u64, bytes: 0 };
            let encoding = scan.topics[topic].encoding;
            visitor.message(&Message { topic, encoding, recorded, bytes, locator });
        }
        Ok(())
    }
}

impl Container for Db3 {
    fn scan(&self, file: u32, scan: &mut Scan, visitor: &mut dyn Visitor) -> DataResult<()> {
        let topics = self.topics(scan, visitor).map_err(|e| {
            failed("is no data base of rosbag2")(e).hint("it needs the tables topics and messages")
        })?;
        let mut last = i64::MIN;
        if let Err(e) = self.walk(file, &topics, &mut last, scan, visitor) {
            let after =
                if last == i64::MIN { "nothing".to_string() } else { format!("up to message {last}") };
            scan.damaged(&DataError::new(format!("{}: read {after}", e.problem())).at(&self.path));
        }
        Ok(())
    }

    fn read(&self, locator: &Locator) -> DataResult<Payload> {
        let connection = self.lock();
        Ok(Payload::Alone(self.message(&connection, locator.at as i64, false)?))
    }

    fn byte(&self, _: &Locator) -> Option<u64> {
        None
    }
}
