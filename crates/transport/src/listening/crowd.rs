//! Connections that share a limited number of places. When a further one arrives, one of them has
//! to go. Synchronous.
//!
//! The one that goes belongs to the peer with the most connections, so that a single machine
//! cannot keep others out. Among that peer's connections, silent ones go first, then the oldest.

use std::{
    cmp::Reverse,
    collections::BTreeMap,
    net::{IpAddr, Ipv6Addr},
    time::Duration,
};

use tokio::time::Instant;
use tokio_util::sync::CancellationToken;

/// Names a connection in a crowd.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub struct MemberId(u64);

/// The number of places, and the time for which each connection is safe.
#[derive(Debug, Clone, Copy)]
pub struct Room {
    /// Number of simultaneous connections; a further one ends another.
    pub n_places: usize,
    /// Least time that each connection has to send something.
    pub silent_grace: Duration,
    /// Least time that a connection keeps its place after it has sent something. While all are
    /// younger, further connections wait in the system's queue. So a whole fleet that reconnects at
    /// once gets in.
    pub heard_grace: Duration,
}

#[derive(Debug)]
struct Member {
    peer: IpAddr,
    since: Instant,
    is_heard: bool,
    has_to_go: CancellationToken,
}

/// The connections.
#[derive(Debug)]
pub struct Crowd {
    room: Room,
    members: BTreeMap<MemberId, Member>,
    n_of_peer: BTreeMap<IpAddr, usize>,
    n_seen: u64,
}

impl Crowd {
    pub fn new(room: Room) -> Self {
        Self { room, members: BTreeMap::new(), n_of_peer: BTreeMap::new(), n_seen: 0 }
    }

    /// Time until the next connection can get a place. If all are taken, the peer with the most
    /// connections has to give one up, once one of its connections has had its time.
    pub fn time_to_place(&self, now: Instant) -> Duration {
        if self.members.len() < self.room.n_places {
            return Duration::ZERO;
        }
        let most = self.n_of_peer.values().max().copied();
        let of_largest = self
            .members
            .values()
            .filter(|member| self.n_of_peer.get(&member.peer).copied() == most);
        let times = of_largest.map(|member| self.time_left(member, now));
        times.min().unwrap_or(Duration::ZERO)
    }

    fn time_left(&self, member: &Member, now: Instant) -> Duration {
        let grace = if member.is_heard { self.room.heard_grace } else { self.room.silent_grace };
        grace.saturating_sub(now.saturating_duration_since(member.since))
    }

    /// Adds a connection. The crowd cancels `has_to_go` when this connection has to go. Returns
    /// whether another one had to go.
    pub fn enter(
        &mut self,
        now: Instant,
        peer: IpAddr,
        has_to_go: CancellationToken,
    ) -> (MemberId, bool) {
        let is_full = self.members.len() >= self.room.n_places;
        if is_full && let Some(id) = self.next_to_go(now) {
            if let Some(member) = self.members.get(&id) {
                member.has_to_go.cancel();
            }
            self.leave(id);
        }
        let peer = network_of(peer);
        self.n_seen += 1;
        let id = MemberId(self.n_seen);
        self.members.insert(id, Member { peer, since: now, is_heard: false, has_to_go });
        *self.n_of_peer.entry(peer).or_default() += 1;
        (id, is_full)
    }

    fn next_to_go(&self, now: Instant) -> Option<MemberId> {
        let order = |member: &Member| {
            let n = self.n_of_peer.get(&member.peer);
            (n, self.time_left(member, now).is_zero(), !member.is_heard, Reverse(member.since))
        };
        // Among equals, `min_by_key` takes the first, which is the oldest.
        let first = self.members.iter().min_by_key(|(_, member)| Reverse(order(member)));
        first.map(|(id, _)| *id)
    }

    /// A connection has sent its first bytes.
    pub fn on_heard(&mut self, id: MemberId) {
        if let Some(member) = self.members.get_mut(&id) {
            member.is_heard = true;
        }
    }

    /// A connection has made a request, so its time starts again.
    pub fn on_request(&mut self, id: MemberId, now: Instant) {
        if let Some(member) = self.members.get_mut(&id) {
            (member.is_heard, member.since) = (true, now);
        }
    }

    /// A connection has gone, or no longer counts here.
    pub fn leave(&mut self, id: MemberId) {
        let Some(member) = self.members.remove(&id) else { return };
        if let Some(n) = self.n_of_peer.get_mut(&member.peer) {
            *n -= 1;
            if *n == 0 {
                self.n_of_peer.remove(&member.peer);
            }
        }
    }
}

/// The network whose connections count together: in IPv6, a machine has a whole network of
/// addresses.
fn network_of(address: IpAddr) -> IpAddr {
    match address.to_canonical() {
        IpAddr::V4(address) => address.into(),
        IpAddr::V6(address) => Ipv6Addr::from_bits(address.to_bits() & (u128::MAX << 64)).into(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const ROOM: Room = Room {
        n_places: 512,
        silent_grace: Duration::from_millis(100),
        heard_grace: Duration::from_millis(500),
    };

    fn ip(last: u8) -> IpAddr {
        IpAddr::from([10, 0, 0, last])
    }

    /// A crowd with a connection in every place, all since `now`.
    fn full(now: Instant) -> (Crowd, Vec<(MemberId, CancellationToken)>) {
        let mut crowd = Crowd::new(ROOM);
        let enter = |_| {
            assert_eq!(crowd.time_to_place(now), Duration::ZERO);
            let token = CancellationToken::new();
            let (id, has_ended_another) = crowd.enter(now, ip(1), token.clone());
            assert!(!has_ended_another);
            (id, token)
        };
        let entered = (0..ROOM.n_places).map(enter).collect();
        (crowd, entered)
    }

    fn ended(entered: &[(MemberId, CancellationToken)]) -> Vec<usize> {
        (0..entered.len()).filter(|&i| entered[i].1.is_cancelled()).collect()
    }

    #[test]
    fn one_connection_too_many_ends_the_oldest_silent_one() {
        let now = Instant::now();
        let (mut crowd, entered) = full(now);
        crowd.on_heard(entered[0].0);
        assert_eq!(crowd.time_to_place(now), ROOM.silent_grace);
        let later = now + ROOM.silent_grace;
        assert_eq!(crowd.time_to_place(later), Duration::ZERO);
        assert!(crowd.enter(later, ip(2), CancellationToken::new()).1);
        assert_eq!(ended(&entered), [1]);
    }

    #[test]
    fn connections_that_send_have_more_time() {
        let now = Instant::now();
        let (mut crowd, entered) = full(now);
        entered.iter().for_each(|(id, _)| crowd.on_heard(*id));
        assert_eq!(crowd.time_to_place(now), ROOM.heard_grace);
        crowd.enter(now + ROOM.heard_grace, ip(2), CancellationToken::new());
        assert_eq!(ended(&entered), [0]);
    }

    #[test]
    fn the_connection_with_the_latest_request_goes_last() {
        let now = Instant::now();
        let (mut crowd, entered) = full(now);
        entered.iter().for_each(|(id, _)| crowd.on_request(*id, now));
        let later = now + ROOM.heard_grace;
        crowd.on_request(entered[0].0, later);
        crowd.enter(later, ip(1), CancellationToken::new());
        assert_eq!(ended(&entered), [1]);
    }

    #[test]
    fn the_peer_with_the_most_connections_makes_room() {
        let now = Instant::now();
        let (mut crowd, entered) = full(now);
        crowd.leave(entered[0].0);
        let alone = CancellationToken::new();
        crowd.enter(now, ip(2), alone.clone());
        let later = now + ROOM.heard_grace;
        for _ in 0..10 * ROOM.n_places {
            crowd.enter(later, ip(3), CancellationToken::new());
        }
        assert!(!alone.is_cancelled());
        assert!(crowd.n_of_peer[&ip(1)].abs_diff(crowd.n_of_peer[&ip(3)]) <= 1, "{crowd:?}");
    }

    #[test]
    fn addresses_of_one_machine_count_as_one_peer() {
        let address = |text: &str| network_of(text.parse().unwrap());
        assert_eq!(address("2001:db8:1:2::3"), address("2001:db8:1:2:ffff::9"));
        assert_ne!(address("2001:db8:1:2::3"), address("2001:db8:1:3::3"));
        assert_eq!(address("::ffff:10.0.0.1"), ip(1));
    }

    #[test]
    fn a_connection_that_leaves_frees_its_place() {
        let now = Instant::now();
        let (mut crowd, entered) = full(now);
        crowd.on_heard(entered[0].0);
        for (id, _) in &entered[..2] {
            crowd.leave(*id);
            assert_eq!(crowd.time_to_place(now), Duration::ZERO);
            assert!(!crowd.enter(now, ip(2), CancellationToken::new()).1);
        }
        assert_eq!(ended(&entered), [0; 0]);
    }
}
