//! What a server knows of its goals, by the rules of rcl_action. No DDS in here.

use std::collections::{BTreeMap, BTreeSet};
use std::time::{Duration, Instant};

pub use ros2_client::action_msgs::CancelGoalResponseEnum as CancelReturn;
use ros2_client::action_msgs::{GoalInfo, GoalStatus as GoalStatusEntry, GoalStatusArray};
use ros2_client::builtin_interfaces::Time;
use tokio::sync::watch;

use super::{GoalId, GoalStatus};

/// How long a result is kept for those who ask late.
pub(super) const KEPT: Duration = Duration::from_secs(15 * 60);
/// Results that are kept at most; the oldest goes first.
const MOST_KEPT: usize = 256;
/// Who waits for the result of one goal, at most; the oldest request goes first.
const MOST_ASKERS: usize = 64;

struct Goal<Asker, R> {
    accepted_nanos: i64,
    status: GoalStatus,
    /// What came of it, and when it ended.
    end: Option<(R, Instant)>,
    /// Who asked for the result before there was one.
    askers: Vec<Asker>,
    cancel: watch::Sender<bool>,
}

/// The goals of a server; `Asker` identifies who asked for a result.
#[allow(
    clippy::struct_field_names,
    reason = "the goals of the goals, not of something else"
)]
pub(super) struct Goals<Asker, R> {
    goals: BTreeMap<GoalId, Goal<Asker, R>>,
    /// Requests that are neither accepted nor rejected yet.
    offered: BTreeSet<GoalId>,
    /// Results and requests that had no room since the last call of [`Self::take_overflow`].
    no_room: u64,
}

impl<Asker, R: Clone + Default> Goals<Asker, R> {
    pub fn new() -> Self {
        Self {
            goals: BTreeMap::new(),
            offered: BTreeSet::new(),
            no_room: 0,
        }
    }

    /// Notes a request; `false` where there is a goal of this id already.
    pub fn offer(&mut self, id: GoalId) -> bool {
        !self.goals.contains_key(&id) && self.offered.insert(id)
    }

    pub fn reject(&mut self, id: GoalId) {
        self.offered.remove(&id);
    }

    /// Accepts what was offered. The receiver turns true when the goal is to be cancelled.
    pub fn accept(&mut self, id: GoalId, now_nanos: i64) -> watch::Receiver<bool> {
        self.offered.remove(&id);
        let (cancel, cancelled) = watch::channel(false);
        let goal = Goal {
            accepted_nanos: now_nanos,
            status: GoalStatus::Accepted,
            end: None,
            askers: Vec::new(),
            cancel,
        };
        self.goals.insert(id, goal);
        cancelled
    }

    pub fn execute(&mut self, id: GoalId) {
        if let Some(goal) = self.goals.get_mut(&id)
            && goal.status == GoalStatus::Accepted
        {
            goal.status = GoalStatus::Executing;
        }
    }

    /// Ends a goal and hands back the status it ended with and who waits for the result. One that nobody asked to cancel
    /// cannot end as cancelled: it is aborted.
    pub fn end(
        &mut self,
        id: GoalId,
        status: GoalStatus,
        result: R,
        now: Instant,
    ) -> (GoalStatus, Vec<Asker>) {
        let Some(goal) = self.goals.get_mut(&id) else {
            return (GoalStatus::Unknown, Vec::new());
        };
        let asked = goal.status == GoalStatus::Canceling;
        goal.status = if status == GoalStatus::Canceled && !asked {
            GoalStatus::Aborted
        } else {
            status
        };
        goal.end = Some((result, now));
        (goal.status, std::mem::take(&mut goal.askers))
    }

    /// The result of a goal, where it has ended or is not known; otherwise the asker is noted.
    pub fn ask(&mut self, id: GoalId, asker: Asker) -> Option<(GoalStatus, R)> {
        match self.goals.get_mut(&id) {
            None => Some((GoalStatus::Unknown, R::default())),
            Some(Goal {
                end: Some((result, _)),
                status,
                ..
            }) => Some((*status, result.clone())),
            Some(goal) => {
                if goal.askers.len() == MOST_ASKERS {
                    goal.askers.remove(0);
                    self.no_room += 1;
                }
                goal.askers.push(asker);
                None
            }
        }
    }

    /// Which goals a request cancels: zero stands for any goal, and for no limit of the time of acceptance.
    pub fn cancel(&mut self, id: GoalId, stamp_nanos: i64) -> (CancelReturn, Vec<GoalInfo>) {
        let one = (id != GoalId::ZERO).then_some(id);
        let all = one.is_none() && stamp_nanos == 0;
        let mut cancelled = Vec::new();
        for (id, goal) in &mut self.goals {
            let meant =
                all || one == Some(*id) || (stamp_nanos != 0 && goal.accepted_nanos <= stamp_nanos);
            if meant && matches!(goal.status, GoalStatus::Accepted | GoalStatus::Executing) {
                goal.status = GoalStatus::Canceling;
                goal.cancel.send_replace(true);
                cancelled.push(info(*id, goal));
            }
        }
        let code = match one.map(|id| self.goals.get(&id)) {
            Some(None) if cancelled.is_empty() => CancelReturn::UnknownGoal,
            Some(Some(_)) if cancelled.is_empty() => CancelReturn::GoalTerminated,
            _ => CancelReturn::None,
        };
        (code, cancelled)
    }

    /// Forgets what ended so long ago that nobody will ask any more.
    pub fn forget_old(&mut self, now: Instant) {
        self.goals.retain(|_, goal| {
            goal.end
                .as_ref()
                .is_none_or(|(_, ended)| now.duration_since(*ended) < KEPT)
        });
        let ended = |(id, goal): (&GoalId, &Goal<Asker, R>)| {
            let (_, ended) = goal.end.as_ref()?;
            Some((*ended, *id))
        };
        let mut kept: Vec<(Instant, GoalId)> = self.goals.iter().filter_map(ended).collect();
        kept.sort_unstable();
        for (_, id) in kept.iter().take(kept.len().saturating_sub(MOST_KEPT)) {
            self.goals.remove(id);
            self.no_room += 1;
        }
    }

    /// How many results and requests for them were forgotten before their time, for want of room, since the last call.
    pub fn take_overflow(&mut self) -> u64 {
        std::mem::take(&mut self.no_room)
    }

    pub fn statuses(&self) -> GoalStatusArray {
        let entries = self.goals.iter().map(|(id, goal)| GoalStatusEntry {
            goal_info: info(*id, goal),
            status: goal.status,
        });
        GoalStatusArray {
            status_list: entries.collect(),
        }
    }
}

fn info<Asker, R>(goal_id: GoalId, goal: &Goal<Asker, R>) -> GoalInfo {
    GoalInfo {
        goal_id,
        stamp: Time::from_nanos(goal.accepted_nanos),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    type Table = Goals<u32, i32>;

    fn running(table: &mut Table, nanos: i64) -> (GoalId, watch::Receiver<bool>) {
        let id = GoalId::new_random();
        assert!(table.offer(id));
        let cancelled = table.accept(id, nanos);
        table.execute(id);
        (id, cancelled)
    }

    fn status(table: &Table, id: GoalId) -> GoalStatus {
        let list = table.statuses().status_list;
        let entry = list.into_iter().find(|entry| entry.goal_info.goal_id == id);
        entry.map_or(GoalStatus::Unknown, |entry| entry.status)
    }

    /// An id is taken from the request on, and free again after a rejection.
    #[test]
    fn an_id_is_used_once() {
        let mut table = Table::new();
        let id = GoalId::new_random();
        assert!(table.offer(id) && !table.offer(id));
        table.reject(id);
        assert!(table.offer(id));
        table.accept(id, 1);
        assert!(!table.offer(id));
    }

    /// Who asks early waits, who asks late is answered at once, and after a quarter of an hour nobody knows.
    #[test]
    fn results_are_kept() {
        let mut table = Table::new();
        let (id, _) = running(&mut table, 1);
        assert_eq!(table.ask(id, 7), None);
        let now = Instant::now();
        assert_eq!(
            table.end(id, GoalStatus::Succeeded, 42, now),
            (GoalStatus::Succeeded, vec![7])
        );
        assert_eq!(table.ask(id, 8), Some((GoalStatus::Succeeded, 42)));
        table.forget_old(now + KEPT / 2);
        assert_eq!(table.ask(id, 8), Some((GoalStatus::Succeeded, 42)));
        table.forget_old(now + KEPT);
        assert_eq!(table.ask(id, 8), Some((GoalStatus::Unknown, 0)));
    }

    /// What is kept has bounds, and what goes for want of room is counted.
    #[test]
    fn what_is_kept_has_bounds() {
        let mut table = Table::new();
        let now = Instant::now();
        let goals: Vec<GoalId> = (0..MOST_KEPT + 3)
            .map(|k| {
                let (id, _) = running(&mut table, 1);
                let ended = now + Duration::from_millis(k as u64);
                table.end(id, GoalStatus::Succeeded, 42, ended);
                id
            })
            .collect();
        table.forget_old(now + KEPT / 2);
        assert_eq!(table.take_overflow(), 3);
        assert_eq!(status(&table, goals[2]), GoalStatus::Unknown);
        assert_eq!(status(&table, goals[3]), GoalStatus::Succeeded);

        let (id, _) = running(&mut table, 1);
        for asker in 0..=MOST_ASKERS {
            table.ask(id, u32::try_from(asker).unwrap_or(0));
        }
        let (_, askers) = table.end(id, GoalStatus::Succeeded, 1, now);
        assert_eq!((askers.len(), askers[0]), (MOST_ASKERS, 1));
        assert_eq!((table.take_overflow(), table.take_overflow()), (1, 0));
    }

    /// The four kinds of request, by id and by time of acceptance.
    #[test]
    fn cancels_what_is_meant() {
        for (by_id, stamp, expected) in [
            (false, 0, [true, true, true]),
            (false, 20, [true, true, false]),
            (true, 0, [false, false, true]),
            (true, 10, [true, false, true]),
        ] {
            let mut table = Table::new();
            let goals = [10, 20, 30].map(|nanos| running(&mut table, nanos));
            let id = if by_id { goals[2].0 } else { GoalId::ZERO };
            let (code, cancelled) = table.cancel(id, stamp);
            assert_eq!(code, CancelReturn::None);
            assert_eq!(
                cancelled.len(),
                expected.iter().filter(|meant| **meant).count()
            );
            for ((id, flag), meant) in goals.into_iter().zip(expected) {
                assert_eq!(*flag.borrow(), meant);
                assert_eq!(status(&table, id) == GoalStatus::Canceling, meant);
            }
        }
    }

    /// What cannot be cancelled is told apart: never heard of, and over.
    #[test]
    fn refusals_of_a_cancel() {
        let mut table = Table::new();
        assert_eq!(table.cancel(GoalId::ZERO, 0).0, CancelReturn::None);
        let unknown = GoalId::new_random();
        assert_eq!(table.cancel(unknown, 0).0, CancelReturn::UnknownGoal);
        let (id, _) = running(&mut table, 1);
        table.end(id, GoalStatus::Aborted, 0, Instant::now());
        assert_eq!(table.cancel(id, 0).0, CancelReturn::GoalTerminated);
    }

    /// Cancelled is only what somebody asked to cancel.
    #[test]
    fn nothing_is_cancelled_unasked() {
        let mut table = Table::new();
        let (id, _) = running(&mut table, 1);
        let (ended, _) = table.end(id, GoalStatus::Canceled, 0, Instant::now());
        assert_eq!(ended, GoalStatus::Aborted);
        let (id, _) = running(&mut table, 2);
        table.cancel(id, 0);
        let (ended, _) = table.end(id, GoalStatus::Canceled, 0, Instant::now());
        assert_eq!(ended, GoalStatus::Canceled);
    }
}
