//! What joints have while effects of the whole arm are looked for: their laws, and what of them is free.

use crate::choose::Chosen;
use crate::kinds::Kind;
use crate::law::{Law, Param};
use crate::prepare::Joint;

/// A joint's account: its law and what of it is free.
#[derive(Clone)]
pub(crate) struct Account {
    pub(crate) law: Law,
    pub(crate) free: Vec<Param>,
}

/// Accounts of all joints; `None` for those that did not move.
pub(crate) type Accounts = Vec<Option<Account>>;

impl Account {
    fn of(own: &Chosen) -> Account {
        Account { law: own.fit.law, free: own.fit.free.clone() }
    }

    /// Its encoder's zero is what the whole arm says.
    pub(crate) fn put_zero_off(&mut self, offset: f64) {
        self.free.retain(|param| *param != Param::Offset);
        self.law[Param::Offset] = offset;
    }
}

/// What joints were found to have.
pub(crate) fn accounts(chosen: &[Option<Chosen>]) -> Accounts {
    chosen.iter().map(|own| own.as_ref().map(Account::of)).collect()
}

/// The same without the kinds that go, by joint.
pub(crate) fn without(chosen: &[Option<Chosen>], joints: &[Joint], goes: impl Fn(usize, Kind) -> bool) -> Accounts {
    let one = |(j, (own, joint)): (usize, (&Option<Chosen>, &Joint))| {
        let own = own.as_ref()?;
        let mut account = Account::of(own);
        let (gone, stay): (Vec<Kind>, Vec<Kind>) = own.kinds.iter().map(|own| own.0).partition(|kind| goes(j, *kind));
        for kind in gone {
            kind.clear(&mut account.law, &joint.start, &stay);
            let stays = |param: &Param| stay.iter().any(|kind| kind.parameters().iter().any(|own| own.0 == *param));
            account.free.retain(|param| stays(param) || !kind.parameters().iter().any(|(own, _, _)| own == param));
        }
        Some(account)
    };
    chosen.iter().zip(joints).enumerate().map(one).collect()
}
