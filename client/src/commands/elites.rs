//! What `swarmctl repertoire` and `swarmctl front` share: the generation that they show, and the
//! addresses of elites.

use model::Who;
use swarm_proto::v1::{Elite, Experiment};

use crate::{
    address::NamedAddress,
    connection::Connection,
    error::{Code, Error},
};

/// The experiment of an address ID or ID@G, and its generation G. `what`: the thing to show, for
/// people.
pub async fn experiment_at(
    connection: &Connection,
    address: &NamedAddress,
    what: &str,
) -> Result<(Experiment, Option<u64>), Error> {
    let address = connection.resolve(address).await?;
    let generation = match address.who {
        Who::Champion => None,
        Who::Generation(generation) => Some(generation),
        _ => {
            let message = format!("`{address}` is not a {what}: name ID or ID@G");
            return Err(Error::at(Code::BadArgument, address, message));
        }
    };
    let (experiment, _) = connection.stored(address.experiment.0).await?;
    Ok((experiment, generation))
}

/// The address of an elite, in the experiment in which it was born.
pub fn address(elite: &Elite) -> String {
    format!("{}@{}/{}", elite.experiment_id, elite.generation, elite.individual)
}
