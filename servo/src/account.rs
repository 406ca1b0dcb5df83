//! What joints have while effects of the whole arm are looked for: their laws, and what of them is free.

use crate::choose::{Chosen, From};
use crate::fit::Fit;
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

/// Where choices begin beside these fits: at the kinds that joints were found to have, as far as they are free there.
pub(crate) fn beginnings(chosen: &[Option<Chosen>], fits: &[Option<Fit>]) -> Vec<From> {
    let one = |(own, fit): (&Option<Chosen>, &Option<Fit>)| {
        let (Some(own), Some(fit)) = (own, fit) else { return From::Nothing };
        let is_free = |kind: &Kind| kind.parameters().iter().all(|(param, _, _)| fit.free.contains(param));
        From::Account(fit.law, own.kinds.iter().map(|own| own.0).filter(is_free).collect())
    };
    chosen.iter().zip(fits).map(one).collect()
}
