//! Tables of a simulator as dicts, documented in `_core.pyi`.

use crate::arrays::square;
use numpy::IntoPyArray;
use pyo3::{exceptions::PyValueError, prelude::*, types::PyDict};
use skate_core::{
    contact::equations::unknowns,
    events::guards::Guards,
    laws::LawRecord,
    model::{contact_mode::SoleContact, layout::ROOT, rigid_body::Axis},
    rhs::{link_segments, pivot_to_ankle},
    sim::Simulation,
};

pub fn size<'py>(py: Python<'py>, sim: &Simulation) -> PyResult<Bound<'py, PyDict>> {
    let model = &sim.model;
    let (root, multipliers) = unknowns(sim.state.mode);
    let rows = model.modes().into_iter().map(|mode| unknowns(mode).1).max();
    let dict = PyDict::new(py);
    dict.set_item("dof", model.dof())?;
    dict.set_item("rows", rows)?;
    dict.set_item("guards", Guards::all(model).len())?;
    dict.set_item("accelerations", model.n - ROOT + root)?;
    dict.set_item("multipliers", multipliers)?;
    Ok(dict)
}

pub fn bodies<'py>(py: Python<'py>, sim: &Simulation) -> PyResult<Vec<Bound<'py, PyDict>>> {
    let model = &sim.model;
    let leg = sim.state.support_leg;
    let [y, z] = pivot_to_ankle(model, SoleContact::Toe);
    let mut bodies = Vec::new();
    for (b, body) in model.bodies.iter().enumerate() {
        // The frame of the first body has its origin at the pivot, to which y0, z0 and q1 refer.
        let own = if b == 0 { [0.0, y, z] } else { [0.0; 3] };
        let up = if b > 0 && body.parent == 0 {
            [0.0, y, z]
        } else {
            [0.0; 3]
        };
        let com = link_segments::com(model, b, leg);
        let side = link_segments::side_offset(model, b, leg);
        let offset = [
            body.offset.x + side,
            body.offset.y + up[1],
            body.offset.z + up[2],
        ];
        let inertia: Vec<f64> = body.inertia.iter().copied().collect();
        let dict = PyDict::new(py);
        dict.set_item("name", body.name)?;
        dict.set_item("joint", model.names[b + 2])?;
        dict.set_item("parent", if b == 0 { -1 } else { body.parent as i64 })?;
        let axis = match body.axis {
            Axis::X => "x",
            Axis::Y => "y",
            Axis::Z => "z",
        };
        dict.set_item("axis", axis)?;
        dict.set_item("offset", offset.to_vec().into_pyarray(py))?;
        dict.set_item("mass", body.mass)?;
        dict.set_item(
            "com",
            vec![com.x, com.y + own[1], com.z + own[2]].into_pyarray(py),
        )?;
        dict.set_item("inertia", square(py, inertia, 3)?)?;
        dict.set_item("damping", body.damping)?;
        bodies.push(dict);
    }
    Ok(bodies)
}

pub fn stats<'py>(py: Python<'py>, sim: &Simulation) -> PyResult<Bound<'py, PyDict>> {
    let stats = &sim.stats;
    let dict = PyDict::new(py);
    dict.set_item("steps", stats.steps)?;
    dict.set_item("rejections", stats.rejections)?;
    dict.set_item("evaluations", stats.evaluations)?;
    dict.set_item("events", stats.events)?;
    dict.set_item("root_iterations", stats.root_iterations)?;
    dict.set_item("projections", stats.projections)?;
    dict.set_item("factorisations", stats.factorisations)?;
    dict.set_item("error_estimate", stats.error_estimate)?;
    if sim.model.scene.energy_balance {
        dict.set_item("energy_residual", sim.energy_residual())?;
    }
    Ok(dict)
}

pub fn totals<'py>(py: Python<'py>, sim: &Simulation) -> PyResult<Bound<'py, PyDict>> {
    let totals = sim.totals();
    let dict = PyDict::new(py);
    dict.set_item("slide", totals.slide)?;
    dict.set_item("loaded_slide", totals.loaded_slide)?;
    dict.set_item("steps", totals.swaps)?;
    dict.set_item("flight_time", totals.flight)?;
    dict.set_item("double_support_time", totals.double_support)?;
    Ok(dict)
}

pub fn energy_balance<'py>(py: Python<'py>, sim: &Simulation) -> PyResult<Bound<'py, PyDict>> {
    if !sim.model.scene.energy_balance {
        return Err(PyValueError::new_err(
            "the scene keeps no energy balance: set energy_balance = true",
        ));
    }
    let energy_balance = &sim.state.energy_balance;
    let dict = PyDict::new(py);
    dict.set_item("actuators", energy_balance.actuators)?;
    dict.set_item("kicks", energy_balance.kicks)?;
    dict.set_item("damping", energy_balance.damping)?;
    dict.set_item("friction", energy_balance.friction)?;
    dict.set_item("impacts", energy_balance.impacts)?;
    dict.set_item("capture", energy_balance.capture)?;
    Ok(dict)
}

pub fn steps<'py>(py: Python<'py>, sim: &mut Simulation) -> PyResult<Vec<Bound<'py, PyDict>>> {
    let mut steps = Vec::new();
    for record in sim.take_records() {
        let dict = PyDict::new(py);
        dict.set_item("time", record.time)?;
        dict.set_item("period", record.period)?;
        dict.set_item("slide", record.slide)?;
        dict.set_item("loaded_slide", record.loaded_slide)?;
        dict.set_item("progress", record.progress)?;
        dict.set_item("lowest_head", record.lowest_head)?;
        dict.set_item("deepest_toe", record.deepest_toe)?;
        dict.set_item("inadmissible_time", record.inadmissible_time)?;
        steps.push(dict);
    }
    Ok(steps)
}

pub fn laws<'py>(py: Python<'py>, sim: &Simulation) -> PyResult<Vec<Bound<'py, PyDict>>> {
    let records = sim.law_records().iter();
    records.map(|record| law(py, record)).collect()
}

fn law<'py>(py: Python<'py>, record: &LawRecord) -> PyResult<Bound<'py, PyDict>> {
    let dict = PyDict::new(py);
    dict.set_item("law", record.law.name())?;
    dict.set_item("unit", record.law.unit())?;
    dict.set_item("limit", record.limit)?;
    dict.set_item("largest", record.largest)?;
    dict.set_item("count", record.count)?;
    let breaches = record.first.iter().map(|breach| {
        let dict = PyDict::new(py);
        dict.set_item("time", breach.t)?;
        dict.set_item("amount", breach.amount)?;
        dict.set_item("state", breach.mode.name())?;
        dict.set_item("event", breach.event)?;
        Ok(dict)
    });
    dict.set_item("breaches", breaches.collect::<PyResult<Vec<_>>>()?)?;
    Ok(dict)
}
